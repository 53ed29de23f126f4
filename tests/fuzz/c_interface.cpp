/// The C interface with arbitrary numbers in its structs that describe only existing memory.
#include <dynmesh/dynmesh.h>

#include <cmath>
#include <memory>

#include "input.hpp"

using namespace dynmesh::fuzz;

namespace {

constexpr std::size_t most_vertices = 12;

struct Destroy {
  void operator()(dynmesh_completer* completer) const { dynmesh_destroy(completer); }
};
using Handle = std::unique_ptr<dynmesh_completer, Destroy>;

std::vector<std::uint8_t> state_of(const dynmesh_completer* completer) {
  std::int64_t size = 0;
  require(dynmesh_state_size(completer, &size) == DYNMESH_OK, "a state has a size");
  std::vector<std::uint8_t> state(static_cast<std::size_t>(size));
  require(
      dynmesh_state(completer, state.data(), static_cast<std::int64_t>(state.size())) == DYNMESH_OK,
      "a state is written where there is room");
  return state;
}

/// Numbers of either type, and a view of them that may be invalid.
struct Memory {
  alignas(8) std::array<std::uint8_t, 8 * 3 * most_vertices + 8> bytes{};
  std::int64_t count = 0;
  std::int32_t type = DYNMESH_FLOAT32;

  Memory(Input& input, std::int64_t rows, std::int32_t number_type)
      : count(rows), type(number_type) {
    for (std::size_t i = 0; i < 3 * most_vertices; ++i) {
      if (type == DYNMESH_FLOAT64) {
        const auto x = coordinate<double>(input, i % 8 != 0);
        std::memcpy(&bytes[8 * i], &x, sizeof x);
      } else {
        const auto x = coordinate<float>(input, i % 8 != 0);
        std::memcpy(&bytes[4 * i], &x, sizeof x);
      }
    }
  }
  template <class View>
  View view(Input& input) {
    View seen{bytes.data(), count, 3, 1, type};
    switch (input.below(24)) {
      case 0:
        seen.data = nullptr;
        break;
      case 1:
        seen.data = bytes.data() + 1;
        break;
      case 2:
        seen.type = input.take<std::int32_t>();
        if (seen.type == DYNMESH_FLOAT64) seen.type = 0;  // would exceed the allocated memory
        break;
      case 3:
        seen.count = -1 - static_cast<std::int64_t>(input.below(256));
        break;
      case 4:  // the first axis backwards
        seen.data = bytes.data() + (type == DYNMESH_FLOAT64 ? 16 : 8);
        seen.column_stride = -1;
        break;
      case 5:  // packed
        seen.row_stride = 0;
        break;
      default:
        break;
    }
    return seen;
  }
  [[nodiscard]] double at(std::size_t i) const {
    if (type == DYNMESH_FLOAT64) {
      double x = 0;
      std::memcpy(&x, &bytes[8 * i], sizeof x);
      return x;
    }
    float x = 0;
    std::memcpy(&x, &bytes[4 * i], sizeof x);
    return static_cast<double>(x);
  }
};

void check_refused(dynmesh_status status) {
  require(status == DYNMESH_INVALID_ARGUMENT, "bad calls are invalid arguments");
  require(std::string(dynmesh_last_message()).find(": ") != std::string::npos, "and say why");
}

class Trial {
 public:
  explicit Trial(Input& input) : input_(input) {}

  void run() {
    const auto k = static_cast<std::int64_t>(input_.below(most_vertices + 1));
    type_ = input_.flip() ? DYNMESH_FLOAT64 : DYNMESH_FLOAT32;
    std::vector<std::int32_t> faces(3 * input_.below(12));
    for (auto& corner : faces)
      corner = input_.take<std::int8_t>() % static_cast<int>(most_vertices + 1);
    dynmesh_settings settings;
    require(dynmesh_default_settings(&settings, sizeof settings) == DYNMESH_OK,
            "there are defaults");
    if (input_.flip()) settings.method = DYNMESH_METHOD_DETAIL;
    if (input_.below(8) == 0) {
      settings = input_.take<dynmesh_settings>();
      if (input_.below(8) != 0) settings.size = sizeof settings;
      settings.threads %= 4;
      settings.extra_iterations %= 100;
    }
    Memory first(input_, k, type_);
    const auto view = first.view<dynmesh_points>(input_);
    dynmesh_completer* made = nullptr;
    const auto status = dynmesh_create(
        faces.data(), input_.below(32) == 0 ? -1 : static_cast<std::int64_t>(faces.size() / 3),
        &view, &settings, &made);
    require((status == DYNMESH_OK) == (made != nullptr), "there is a handle or an error");
    if (status != DYNMESH_OK) return check_refused(status);
    completer_.reset(made);
    require(dynmesh_n_vertices(made) == view.count, "it has the vertices of frame 0");
    for (int call = 0; call < 16 && !input_.empty(); ++call) step();
    look();
  }

 private:
  void step() {
    const std::int64_t k = dynmesh_n_vertices(completer_.get());
    const bool misfit = input_.below(16) == 0;
    Memory points(input_, misfit ? k - 1 : k, type_);
    Memory out = points;
    const auto before = state_of(completer_.get());
    auto given = points.view<dynmesh_points>(input_);
    auto written = (input_.flip() ? points : out).view<dynmesh_output>(input_);
    std::array<std::uint8_t, most_vertices + 1> known{};
    for (auto& one : known) one = input_.take<std::uint8_t>() & 3;
    const dynmesh_mask mask{known.data(), misfit && input_.flip() ? k + 1 : k, 1};
    std::array<std::int32_t, most_vertices> indices{};
    for (auto& index : indices)
      index = input_.take<std::int8_t>() % static_cast<int>(most_vertices + 1);
    dynmesh_frame_report report{};
    dynmesh_status status = DYNMESH_OK;
    bool is_frame = true;
    switch (input_.below(7)) {
      case 0:
        status = dynmesh_push(completer_.get(), &given, &mask, &written, &report);
        break;
      case 1:
        status = dynmesh_push(completer_.get(), &given, nullptr, &written, nullptr);
        break;
      case 2:
        given.count =
            std::min<std::int64_t>(given.count, static_cast<std::int64_t>(input_.below(4)));
        status = dynmesh_push_sparse(completer_.get(), indices.data(), given.count, &given,
                                     &written, &report);
        break;
      case 3:
        status = dynmesh_skip(completer_.get(), &written, &report);
        break;
      case 4:
        is_frame = false;
        status = dynmesh_reset(completer_.get(), &given);
        break;
      case 5: {
        is_frame = false;
        auto state = before;
        state[input_.take<std::uint16_t>() % state.size()] ^= input_.take<std::uint8_t>();
        status = dynmesh_restore(completer_.get(), state.data(),
                                 static_cast<std::int64_t>(state.size()) - (misfit ? 1 : 0));
        break;
      }
      default:
        is_frame = false;
        status = dynmesh_state(completer_.get(), out.bytes.data(), input_.take<std::int8_t>());
        if (status == DYNMESH_OK) status = DYNMESH_INTERNAL_ERROR;  // the array is too small
    }
    if (status != DYNMESH_OK) {
      check_refused(status);
      require(state_of(completer_.get()) == before, "a refusal changes nothing");
    } else if (is_frame) {
      const Memory& completed = written.data == points.bytes.data() ? points : out;
      if (written.column_stride != 1) return;
      for (std::size_t i = 0; i < 3 * static_cast<std::size_t>(k); ++i) {
        require(std::isfinite(completed.at(i)), "completed frames are finite");
      }
    }
  }

  void look() {
    const dynmesh_completer* completer = completer_.get();
    dynmesh_topology_report topology;
    require(dynmesh_topology(completer, &topology) == DYNMESH_OK, "there is a topology");
    for (std::int64_t i = -1; i <= topology.refused_faces; ++i) {
      std::int64_t face = 0;
      const char* reason = nullptr;
      const bool exists = i >= 0 && i < topology.refused_faces;
      require((dynmesh_refused_face(completer, i, &face, &reason) == DYNMESH_OK) == exists,
              "refused faces are those that are counted");
    }
    for (std::int64_t v = 0; v < dynmesh_n_vertices(completer); ++v) {
      require(dynmesh_generation(completer)[v] >= -1 && dynmesh_age(completer)[v] >= 0,
              "generations and ages are such");
    }
  }

  Input& input_;
  std::int32_t type_ = DYNMESH_FLOAT32;
  Handle completer_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Input input(data, size);
  Trial(input).run();
  return 0;
}

/// Completers with arbitrary meshes, settings and calls, valid and invalid, compared with a second
/// completer that gets only the valid calls, by way of the C interface and in one thread.
#include <array>
#include <cmath>
#include <cstring>
#include <dynmesh/completer.hpp>
#include <memory>
#include <optional>
#include <stdexcept>

#include "../cpp/c_completer.hpp"
#include "../cpp/seal.hpp"
#include "input.hpp"

namespace dynmesh::fuzz {
namespace {

/// Rows in memory with gaps between them, which must not be written.
template <class Real>
struct Rows {
  std::vector<Real> memory;
  std::ptrdiff_t first = 0;
  std::size_t count = 0;
  std::ptrdiff_t row_stride = 3;
  std::ptrdiff_t column_stride = 1;

  Rows(Input& input, std::size_t rows) : count(rows) {
    const std::size_t layout = input.below(4);
    const auto n = static_cast<std::ptrdiff_t>(rows);
    if (layout == 1) row_stride = 5;
    if (layout == 2) row_stride = -4, first = 4 * std::max<std::ptrdiff_t>(n - 1, 0);
    if (layout == 3) row_stride = 1, column_stride = n + 1;
    memory.assign(5 * rows + 16, filler());
  }
  static Real filler() { return static_cast<Real>(-77.25); }

  [[nodiscard]] Points<Real> view() {
    return {memory.data() + first, count, row_stride, column_stride};
  }
  void fill(std::span<const Real> packed) {
    for (std::size_t i = 0; i < packed.size(); ++i) view()(i / 3, i % 3) = packed[i];
  }
  /// Also checks that the gaps between the rows are unchanged.
  [[nodiscard]] std::vector<Real> packed() {
    std::vector<Real> rows(3 * count);
    std::vector<Real> rest = memory;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      Real& place = view()(i / 3, i % 3);
      rows[i] = place;
      rest[static_cast<std::size_t>(&place - memory.data())] = filler();
    }
    for (const Real x : rest) require(x == filler(), "nothing is written between the rows");
    return rows;
  }
};

template <class Real>
bool same_bytes(std::span<const Real> a, std::span<const Real> b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size_bytes()) == 0);
}

Settings settings_of(Input& input) {
  Settings settings;
  const std::size_t bits = input.below(256);
  settings.method = (bits & 1) != 0 ? Method::detail : Method::motion;
  settings.disconnected = (bits & 2) != 0 ? DisconnectedRule::hold : DisconnectedRule::follow;
  settings.threads = (bits & 12) == 12 ? 2 : 1;
  if (settings.method == Method::motion ||
      (bits & 0xf0) == 0xf0) {  // otherwise refused, which is rare
    settings.revisit = (bits & 16) == 0;
    settings.extra_iterations = static_cast<Index>(input.below(20)) - ((bits & 32) != 0 ? 1 : 0);
  }
  if (settings.method == Method::detail || (bits & 0xf0) == 0xe0) {
    settings.reject_outliers = (bits & 64) != 0;
    settings.learn = (bits & 32) != 0;
    settings.uncertainty = (bits & 4) != 0;
    if ((bits & 128) != 0) settings.noise = coordinate<double>(input, input.flip());
  }
  return settings;
}

std::vector<Index> faces_of(Input& input, std::size_t k) {
  std::vector<Index> faces;
  const std::size_t shape = input.below(8);
  const auto n = static_cast<Index>(k);
  if (shape < 5) {  // a strip, open or closed, in which triangles may occur twice
    const Index end = shape < 2 ? n : n - 2;
    for (Index v = 0; v < end; ++v) {
      for (const Index corner : {v, (v + 1) % n, (v + 2) % n}) faces.push_back(corner);
    }
  }
  const std::size_t more = shape == 0 || shape >= 5 ? 1 + input.below(48) : input.below(4);
  for (std::size_t i = 0; i < 3 * more; ++i) {
    const auto v = static_cast<Index>(input.below(k));
    faces.push_back(shape == 7 && input.below(64) == 63 ? input.take<Index>() : v);
  }
  return faces;
}

constexpr std::size_t most_vertices = 40;
constexpr std::size_t most_calls = 24;

template <class Real>
class Trial {
 public:
  explicit Trial(Input& input) : input_(input) {}

  void run() {
    tame_ = input_.below(4) != 0;
    k_ = input_.below(32) == 0 ? 0 : 1 + input_.below(most_vertices);
    settings_ = settings_of(input_);
    faces_ = k_ == 0 ? std::vector<Index>{} : faces_of(input_, k_);
    const auto first = positions(k_);
    previous_ = first;
    try {
      if (settings_.method == Method::detail && input_.below(4) == 0) train();
      subject_ = make(first, settings_);
    } catch (const std::invalid_argument&) {
      return;
    }
    Settings alone = settings_;
    alone.threads = 1;
    twin_ = std::make_unique<testing::CCompleter<Real>>(Faces{faces_.data(), faces_.size() / 3},
                                                        view(first), alone,
                                                        training_ ? &*training_ : nullptr);
    require(twin_->n_vertices() == k_, "it has the vertices of frame 0");
    start_ = first;
    for (std::size_t call = 0; call < most_calls && !input_.empty(); ++call) step();
  }

 private:
  using Known = std::vector<std::uint8_t>;

  std::unique_ptr<Completer<Real>> make(const std::vector<Real>& first, const Settings& settings) {
    const Faces faces{faces_.data(), faces_.size() / 3};
    if (!training_) return std::make_unique<Completer<Real>>(faces, view(first), settings);
    return std::make_unique<Completer<Real>>(faces, view(first), settings, *training_);
  }

  void train() {
    training_.emplace(k_);
    const std::size_t n_frames = 2 + input_.below(4);
    for (std::size_t n = 0; n < n_frames; ++n) training_->add(view(positions(k_)));
  }

  std::vector<Real> positions(std::size_t rows) {
    const bool from_last = tame_ && previous_.size() == 3 * rows && input_.flip();
    std::vector<Real> packed(3 * rows);
    for (std::size_t i = 0; i < packed.size(); ++i) {
      packed[i] = coordinate<Real>(input_, tame_);
      if (from_last) packed[i] = previous_[i] + packed[i] / 16;
    }
    return packed;
  }

  Known mask() {
    Known known(k_);
    std::uint64_t bits = input_.take<std::uint64_t>();
    if (input_.flip()) bits &= input_.take<std::uint64_t>();
    for (std::size_t v = 0; v < k_; ++v) known[v] = (bits >> (v % 64)) & 1U;
    return known;
  }

  void step() {
    constexpr std::array calls = {&Trial::push_with_mask,
                                  &Trial::push_with_mask,
                                  &Trial::push_with_mask,
                                  &Trial::push_finite_rows,
                                  &Trial::push_finite_rows,
                                  &Trial::push_sparse,
                                  &Trial::skip,
                                  &Trial::reset,
                                  &Trial::move,
                                  &Trial::restore_anything};
    // Nothing is called for larger numbers, so that the inputs that are kept make the same calls.
    const std::size_t call = input_.below(12);
    if (call < calls.size()) (this->*calls[call])();
  }

  /// Calls `call`, which must either succeed, or throw and change nothing.
  template <class Call>
  bool accepted(const Call& call) {
    const auto before = subject_->state();
    try {
      call();
      return true;
    } catch (const std::invalid_argument& error) {
      require(std::string(error.what()).find(": ") != std::string::npos,
              "an error names its cause");
      require(subject_->state() == before, "a refusal changes nothing");
      return false;
    }
  }

  void push_with_mask() {
    const auto packed = positions(k_);
    const Known known = mask();
    const std::ptrdiff_t stride = input_.flip() ? 1 : 3;
    Known spread(3 * k_ + 1, 1);
    for (std::size_t v = 0; v < k_; ++v) {
      spread[v * static_cast<std::size_t>(stride)] = known[v] != 0 ? 1 + (v & 0x7f) : 0;
    }
    Rows<Real> rows(input_, k_);
    rows.fill(packed);
    const bool in_place = input_.flip();
    Rows<Real> apart(input_, k_);
    Rows<Real>& out = in_place ? rows : apart;
    if (!accepted([&] {
          subject_->push(rows.view(), KnownMask(spread.data(), k_, stride), out.view());
        })) {
      require(same_bytes<Real>(rows.packed(), packed), "a refusal writes nothing");
      return;
    }
    finish(packed, known, out.packed(), [&](auto completed) {
      twin_->push(view(packed), {known.data(), k_}, completed);
    });
  }

  void push_finite_rows() {
    auto packed = positions(k_);
    const Known known = mask();
    for (std::size_t v = 0; v < k_; ++v) {
      if (known[v] == 0) packed[3 * v + v % 3] = std::numeric_limits<Real>::quiet_NaN();
    }
    Rows<Real> rows(input_, k_);
    rows.fill(packed);
    if (!accepted([&] { subject_->push(rows.view(), rows.view()); })) return;
    Known finite(k_);
    for (std::size_t v = 0; v < k_; ++v) {
      const Real* p = &packed[3 * v];
      finite[v] = std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]) ? 1 : 0;
    }
    finish(packed, finite, rows.packed(),
           [&](auto completed) { twin_->push(view(packed), completed); });
  }

  void push_sparse() {
    const std::size_t n = input_.below(k_ + 2);
    std::vector<Index> indices;
    for (std::size_t i = 0; i < n; ++i) indices.push_back(static_cast<Index>(input_.below(k_ + 1)));
    if (input_.flip()) {  // valid in half of the cases
      std::ranges::sort(indices);
      indices.erase(std::unique(indices.begin(), indices.end()), indices.end());
      if (!indices.empty() && indices.back() == static_cast<Index>(k_)) indices.pop_back();
    }
    const auto observed = positions(indices.size());
    Rows<Real> rows(input_, indices.size());
    rows.fill(observed);
    Rows<Real> out(input_, k_);
    if (!accepted([&] { subject_->push_sparse(indices, rows.view(), out.view()); })) return;
    std::vector<Real> packed(3 * k_, Real{0});
    Known known(k_);
    for (std::size_t i = 0; i < indices.size(); ++i) {
      const auto v = static_cast<std::size_t>(indices[i]);
      require(known[v] == 0, "no index is accepted twice");
      known[v] = 1;
      std::copy_n(&observed[3 * i], 3, &packed[3 * v]);
    }
    finish(packed, known, out.packed(),
           [&](auto completed) { twin_->push_sparse(indices, view(observed), completed); });
  }

  void skip() {
    Rows<Real> out(input_, k_);
    subject_->skip(out.view());
    finish(std::vector<Real>(3 * k_), Known(k_), out.packed(),
           [&](auto completed) { twin_->skip(completed); });
  }

  void reset() {
    const auto packed = positions(k_);
    if (!accepted([&] { subject_->reset(view(packed)); })) return;
    twin_->reset(view(packed));
    previous_ = packed;
    for (const Index age : subject_->age()) require(age == 0, "all is known after a reset");
  }

  /// Continues from the state in a new completer.
  void move() {
    const auto state = subject_->state();
    // A training sequence must have the size of frame 0.
    auto other = make(training_ ? start_ : std::vector<Real>(3 * k_, Real{1}), settings_);
    other->restore(state);
    require(other->state() == state && twin_->state() == state, "a state restores to itself");
    require(std::ranges::equal(other->generation(), subject_->generation()), "generations move");
    subject_ = std::move(other);
  }

  /// Restores a state that was changed or cut, with a valid checksum; an accepted one must be
  /// usable.
  void restore_anything() {
    auto state = subject_->state();
    const std::size_t changes = input_.below(6);
    for (std::size_t i = 0; i < changes && !state.empty(); ++i) {
      const std::size_t place = input_.take<std::uint16_t>() % state.size();
      switch (input_.below(4)) {
        case 0:
          state[place] = std::byte{input_.take<std::uint8_t>()};
          break;
        case 1: {
          const auto value = coordinate<Real>(input_, false);
          const std::size_t at = place & ~(sizeof value - 1);
          if (at + sizeof value <= state.size()) std::memcpy(&state[at], &value, sizeof value);
          break;
        }
        case 2:
          state[place] ^= std::byte{input_.take<std::uint8_t>()};
          break;
        default:
          state.resize(place);
      }
    }
    if (state.size() >= 8 && input_.below(16) != 0) testing::seal(state);
    if (!accepted([&] { subject_->restore(state); })) return;
    // Coefficients of parts that the surface does not have are read and forgotten.
    require(training_ || subject_->state() == state, "what is accepted is kept");
    state = subject_->state();
    twin_->restore(state);
  }

  static Points<const Real> view(const std::vector<Real>& packed) {
    return {packed.data(), packed.size() / 3};
  }

  /// Checks a frame: the input was `packed` with the mask `known`, and the result is `completed`.
  template <class Push>
  void finish(const std::vector<Real>& packed, const Known& known,
              const std::vector<Real>& completed, const Push& push_twin) {
    const FrameReport& report = subject_->report();
    require(report.known + report.filled + report.disconnected == k_, "every vertex is counted");
    std::size_t given = 0;
    for (std::size_t v = 0; v < k_; ++v) {
      for (std::size_t c = 3 * v; c < 3 * v + 3; ++c) {
        require(std::isfinite(completed[c]), "completed frames are finite");
      }
      given += known[v];
      const bool is_anchor = subject_->generation()[v] == 0;
      require((subject_->age()[v] == 0) == is_anchor, "anchors are of age 0, others are older");
      require(!is_anchor || known[v] != 0, "anchors were given");
      require(is_anchor || known[v] == 0 || settings_.reject_outliers,
              "what was given is an anchor");
      if (!is_anchor || settings_.noise) continue;
      require(std::memcmp(&completed[3 * v], &packed[3 * v], 3 * sizeof(Real)) == 0,
              "anchors are as given, to the last bit");
    }
    require(report.known + report.rejected == given, "anchors are counted");

    Rows<Real> of_twin(input_, k_);
    push_twin(of_twin.view());
    require(same_bytes<Real>(of_twin.packed(), completed), "the twin comes to the same");
    require(std::ranges::equal(twin_->generation(), subject_->generation()), "and by the same way");
    require(std::ranges::equal(twin_->age(), subject_->age()), "after the same time");
    require(testing::are_same(twin_->report(), report), "and reports the same");
    if (settings_.uncertainty) {
      require(same_bytes<Real>(twin_->standard_error(), subject_->standard_error()),
              "with the same standard errors");
    }
    previous_ = completed;
  }

  Input& input_;
  bool tame_ = true;
  std::size_t k_ = 0;
  Settings settings_;
  std::vector<Index> faces_;
  std::unique_ptr<Completer<Real>> subject_;
  std::unique_ptr<testing::CCompleter<Real>> twin_;
  std::optional<Training<Real>> training_;
  std::vector<Real> start_;     // the first frame 0
  std::vector<Real> previous_;  // the last completed frame
};

}  // namespace
}  // namespace dynmesh::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  dynmesh::fuzz::Input input(data, size);
  if (input.flip()) {
    dynmesh::fuzz::Trial<double>(input).run();
  } else {
    dynmesh::fuzz::Trial<float>(input).run();
  }
  return 0;
}

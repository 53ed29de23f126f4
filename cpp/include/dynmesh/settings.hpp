/// The settings of a completer.
#pragma once

#include <dynmesh/export.hpp>
#include <dynmesh/types.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

namespace dynmesh {

enum class Method {
  /// Averages motion vectors, as in the paper; see motion.hpp. A frame of ten thousand vertices
  /// takes tenths of a millisecond, and no memory is allocated after construction.
  motion,
  /// Preserves the shape of frame 0 and of the last frame, rotated with the motion; see
  /// docs/method.md. The error is a fraction of that of motion, but a frame takes milliseconds.
  /// Memory is allocated when the factor of the system of a frame is larger than all earlier ones.
  /// Time and memory grow with the square of the number of neighbours of a vertex.
  detail
};

/// How vertices that are not connected to any anchor are completed.
enum class DisconnectedRule {
  hold,   ///< they keep their previous positions
  follow  ///< their component moves rigidly with one that is seen, touched it and stayed beside it
};

struct Settings {
  Method method = Method::detail;

  /// If true, every iteration estimates all satellites reached so far. If false, each satellite is
  /// estimated once, when it is reached, and errors accumulate from frame to frame. False requires
  /// method motion.
  bool revisit = true;

  /// The number of iterations after the one that reaches the last satellite, 0 to 1 000 000. Ten
  /// reduce the error by a third on many sequences and increase it on some. They have no effect if
  /// `revisit` is false. Numbers above 0 require method motion.
  Index extra_iterations = 0;

  /// How vertices that are not connected to any anchor are completed.
  DisconnectedRule disconnected = DisconnectedRule::follow;

  /// The standard deviation of the noise of the anchors, positive and in the unit of the positions.
  /// If it is not set, anchors are exact. With noise, anchors move as well, according to the shape
  /// around them. Requires method detail.
  std::optional<double> noise = std::nullopt;

  /// Whether anchors whose motion contradicts that of the anchors around them are treated as
  /// unknown in this frame, and estimated. FrameReport::rejected counts them. Requires method
  /// detail.
  bool reject_outliers = false;

  /// Whether the completer learns how the shape of the subject varies from the frames that it
  /// completes. Cannot be combined with a training sequence. Useful where motions recur. A frame
  /// takes about twice as long, and a state has 384 bytes more per vertex. Requires method detail.
  bool learn = false;

  /// Whether the standard error of each vertex is estimated: see
  /// Completer::standard_error. The completed positions do not depend on it. Requires method
  /// detail.
  bool uncertainty = false;

  /// The number of threads that may work on a frame, including the calling thread, 1 to 256. More
  /// than one helps from 23 553 vertices on; smaller meshes are completed by the calling thread
  /// alone. The others sleep between frames. If `revisit` is false, they only read and write
  /// positions. Results are identical for any number of threads.
  Index threads = 1;
};

/// A setting that is refused. The message begins with the setting's name and a colon.
class DYNMESH_EXPORT SettingError : public std::invalid_argument {
 public:
  SettingError(std::string setting, std::string reason)
      : std::invalid_argument(setting + ": " + reason),
        setting_(std::move(setting)),
        reason_(std::move(reason)) {}

  [[nodiscard]] const std::string& setting() const { return setting_; }
  [[nodiscard]] const std::string& reason() const { return reason_; }

 private:
  std::string setting_;
  std::string reason_;
};

/// Throws SettingError, which names the setting and its value.
DYNMESH_EXPORT void check_settings(const Settings& settings);

}  // namespace dynmesh

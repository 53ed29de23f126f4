/// How a completer works. The defaults are the paper's method.
#pragma once

#include <dynmesh/export.hpp>
#include <dynmesh/types.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

namespace dynmesh {

enum class Method {
  /// The paper's averaged motion vectors: motion.hpp. Tenths of a millisecond at ten thousand
  /// vertices, nothing allocated after construction.
  motion,
  /// Keeps the shape of frame 0 and of the last frame, turned with the motion: docs/method.md. A
  /// fraction of the error, in milliseconds where motion takes tenths of one; allocates where its
  /// factor is larger than all before.
  detail
};

/// What becomes of the vertices that no chain of edges ties to an anchor.
enum class UnseenRule {
  hold,   ///< they stay where they were
  follow  ///< their component moves rigidly, as the surface nearest to it in frame 0 does
};

struct Settings {
  Method method = Method::motion;

  /// true: every iteration estimates all satellites reached so far. false: each satellite is
  /// estimated once, when it is reached, and errors feed on themselves from frame to frame.
  /// A setting of method motion; detail refuses false.
  bool revisit = true;

  /// Iterations after the one that reaches the last satellite, 0 to 1 000 000. Ten take off a third
  /// of the error on many sequences, and add to it on some; without `revisit` they change nothing.
  /// A setting of method motion; detail refuses all but 0.
  Index extra_iterations = 0;

  /// Vertices that no chain of edges ties to an anchor follow the nearest surface, or stay.
  UnseenRule unseen = UnseenRule::follow;

  /// Standard deviation of the anchors' noise, in the unit of the positions, positive; none: they
  /// are exact. With noise, anchors move too, as far as the shape around them says. A setting of
  /// method detail; motion, which takes anchors exactly as they are, refuses it.
  std::optional<double> noise = std::nullopt;

  /// Whether anchors whose motion contradicts that of the anchors around them are taken as unknown
  /// for the frame, and estimated; FrameReport::rejected counts them. A setting of method detail;
  /// motion refuses it.
  bool reject_outliers = false;

  /// Threads that a frame may use, the caller's among them, 1 to 256. Others sleep between frames.
  /// They are used for meshes of 23 553 vertices or more, with method detail of 5 889 or more; the
  /// caller completes smaller ones alone. With `revisit` false, threads only take and give back
  /// positions. Results are the same to the last bit; whether they come sooner depends on the
  /// machine and the mesh: measure it, as script/bench does.
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

/// "motion" or "detail". Throws SettingError for another name.
DYNMESH_EXPORT Method method_from_name(std::string_view name);
/// "hold" or "follow". Throws SettingError for another name.
DYNMESH_EXPORT UnseenRule unseen_rule_from_name(std::string_view name);

}  // namespace dynmesh

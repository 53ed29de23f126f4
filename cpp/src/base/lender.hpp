/// Values of a frame whose memory is used again.
#pragma once

#include <cstddef>
#include <dynmesh/types.hpp>
#include <stdexcept>
#include <utility>
#include <vector>

namespace dynmesh {

template <class T>
class Lender;

/// A T that is lent: when it ends, its memory goes back to the lender, which outlives it.
template <class T>
class Lent : public T {
 public:
  Lent(Lent&& other) noexcept
      : T(std::move(other)), lender_(std::exchange(other.lender_, nullptr)) {}
  Lent& operator=(Lent&& other) noexcept {
    std::swap(static_cast<T&>(*this), static_cast<T&>(other));
    std::swap(lender_, other.lender_);
    return *this;
  }
  Lent(const Lent&) = delete;
  Lent& operator=(const Lent&) = delete;
  ~Lent() {
    if (lender_ != nullptr) lender_->spare_.push_back(std::move(*this));
  }

 private:
  friend Lender<T>;
  Lent(T&& value, Lender<T>& lender) noexcept : T(std::move(value)), lender_(&lender) {}

  Lender<T>* lender_;
};

/// Lends values, so that steps which frames repeat can return what they make without allocating
/// memory. What is lent has the size of the first value and holds anything: who asks for it writes
/// all of it.
template <class T>
class Lender {
 public:
  /// So many may be lent at a time.
  Lender(const T& first, std::size_t most) : spare_(most, first) {}
  /// One may be lent at a time.
  explicit Lender(T&& only) { spare_.push_back(std::move(only)); }

  [[nodiscard]] Lent<T> lend() {
    if (spare_.empty()) throw std::logic_error("more is lent than a lender has");
    Lent<T> value(std::move(spare_.back()), *this);
    spare_.pop_back();
    return value;
  }

 private:
  friend Lent<T>;

  std::vector<T> spare_;
};

/// A field of a frame.
using LentField = Lent<std::vector<Vector3>>;
using FieldLender = Lender<std::vector<Vector3>>;

}  // namespace dynmesh

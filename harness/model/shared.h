#pragma once

#include <memory>
#include <utility>

namespace nullmark {

/// A value that its copies share, so that thousands of records of one medium hold it once.
template <class T>
class Shared {
 public:
  Shared() {
    static const std::shared_ptr<const T> kDefault = std::make_shared<const T>();
    value_ = kDefault;
  }
  Shared(T value) : value_(std::make_shared<const T>(std::move(value))) {}

  const T& operator*() const { return *value_; }
  const T* operator->() const { return value_.get(); }

  /// Changes this one alone: `change` gets a copy to write to.
  template <class F>
  void edit(F&& change) {
    T copy = *value_;
    change(copy);
    *this = Shared(std::move(copy));
  }

  bool operator==(const Shared& other) const { return value_ == other.value_ || *value_ == *other.value_; }

 private:
  std::shared_ptr<const T> value_;
};

}  // namespace nullmark

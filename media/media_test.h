#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <initializer_list>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include "media/base/registry.h"

/// Media made by name, for tests.
namespace nullmark::media_test {

using Setting = std::variant<Real, int, std::string, std::vector<Real>, Vec3>;
using Settings = std::map<std::string, Setting>;

/// Writes settings into a source's parameters by name, as the configuration reader does.
class Setter final : public ParameterVisitor {
 public:
  explicit Setter(Settings settings) : settings_(std::move(settings)) {}
  void number(const char* name, Real& value, Range range, const char*, const char*) override {
    set(name, value);
    EXPECT_TRUE(range.contains(value)) << name << " = " << value;
  }
  void integer(const char* name, int& value, int low, int high, const char*) override {
    set(name, value);
    EXPECT_TRUE(low <= value && value <= high) << name << " = " << value;
  }
  void flag(const char*, bool&, const char*) override { ADD_FAILURE() << "no medium here has flags"; }
  void choice(const char* name, std::string& value, std::initializer_list<const char*> allowed, const char*) override {
    set(name, value);
    EXPECT_TRUE(std::any_of(allowed.begin(), allowed.end(), [&](const char* a) { return value == a; })) << name;
  }
  void text(const char* name, std::string& value, const char*) override { set(name, value); }
  void numbers(const char* name, std::vector<Real>& value, int, int, Range range, const char*, const char*) override {
    set(name, value);
    for (const Real x : value) EXPECT_TRUE(range.contains(x)) << name;
  }
  void texts(const char*, std::vector<std::string>&, const char*) override { ADD_FAILURE() << "no medium here has words"; }
  void object(const char*, std::string&, const char*) override { ADD_FAILURE() << "no medium here has objects"; }
  void point(const char* name, Vec3& value, const char*, const char*) override { set(name, value); }

  /// Names that no parameter has asked for.
  const Settings& left() const { return settings_; }

 private:
  template <class T>
  void set(const char* name, T& value) {
    const auto at = settings_.find(name);
    if (at == settings_.end()) return;
    value = std::get<T>(at->second);
    settings_.erase(at);
  }
  Settings settings_;
};

inline std::shared_ptr<const Medium> make(const std::string& type, const Settings& settings = {}) {
  const MediumEntry* entry = Registry<MediumEntry>::instance().find(type);
  if (entry == nullptr) throw std::runtime_error("not registered: " + type);
  const auto source = entry->make();
  Setter setter(settings);
  source->parameters(setter);
  EXPECT_TRUE(setter.left().empty()) << type << " has no parameter " << setter.left().begin()->first;
  return source->build();
}

/// A box that is no cube and does not begin at 0.
inline const Vec3 kLo(-1.5, 2, 0.25), kHi(0.75, 2.5, 4);

}  // namespace nullmark::media_test

#pragma once

#include <memory>
#include <string>

#include "media/base/registry.h"
#include "media/majorants/majorant.h"

namespace nullmark {

/// A majorant structure's parameters before it is built over a medium.
class MajorantSource {
 public:
  virtual ~MajorantSource() = default;
  virtual void parameters(ParameterVisitor& visit) = 0;
  virtual std::unique_ptr<const MajorantStructure> build(std::shared_ptr<const Medium> medium) const = 0;
};

struct MajorantEntry {
  std::string name, summary, source;
  std::unique_ptr<MajorantSource> (*make)() = nullptr;
};

}  // namespace nullmark

#define NULLMARK_REGISTER_MAJORANT(...)                                                      \
  [[maybe_unused]] static const bool NULLMARK_CONCATENATE(nullmark_majorant_, __COUNTER__) = \
      ::nullmark::Registry<::nullmark::MajorantEntry>::instance().add(                       \
          ::nullmark::registry_entry<::nullmark::MajorantEntry, ::nullmark::MajorantSource, __VA_ARGS__>())

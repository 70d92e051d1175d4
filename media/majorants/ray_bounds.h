#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "media/majorants/majorant.h"

namespace nullmark {

/// The bounds along one ray.  Flights find the cells that they come to; all segments, with their extrema, are listed when a
/// tracker asks for them.  Belongs to one thread.
class RayBounds {
 public:
  RayBounds() = default;
  /// A traversal is not copied.
  RayBounds(const RayBounds& other) { *this = other; }
  RayBounds& operator=(const RayBounds& other) {
    structure_ = other.structure_;
    world_ = other.world_;
    local_ = other.local_;
    is_listed_ = other.is_listed_;
    if (is_listed_) listed_ = other.listed_;
    return *this;
  }

  /// Of a structure that outlives this object's use; rays as for MajorantStructure::segments.
  void start(const MajorantStructure& structure, const Ray& world, const Ray& local) {
    structure_ = &structure;
    world_ = world;
    local_ = local;
    is_listed_ = false;
  }

  /// Of no structure.
  void start(std::vector<Segment> segments, Crossing crossing = Crossing::carry) {
    structure_ = nullptr;
    listed_ = {std::move(segments), crossing};
    is_listed_ = true;
  }

  Crossing crossing() const { return structure_ ? structure_->crossing() : listed_.crossing; }

  const std::vector<Segment>& segments() const {
    if (!is_listed_) structure_->segments(world_, local_, listed_);
    is_listed_ = true;
    return listed_.segments;
  }

  /// Starts the majorant of the ray from `begin` on; it lasts until this object starts another ray.
  void start_rates(Real begin, Rates& rates) {
    if (is_listed_) {
      rates.start(begin, crossing());
      for (const Segment& segment : listed_.segments) rates.append(segment.end, segment.majorant);
      return;
    }
    if (walked_ != structure_) traversal_ = structure_->traversal();
    walked_ = structure_;
    traversal_->start(world_, local_);
    rates.start(begin, crossing(), *traversal_);
  }

 private:
  const MajorantStructure* structure_ = nullptr;
  Ray world_, local_;
  mutable SegmentBuffer listed_;
  mutable bool is_listed_ = true;
  const MajorantStructure* walked_ = nullptr;  ///< the structure of the traversal
  std::unique_ptr<Traversal> traversal_;
};

}  // namespace nullmark

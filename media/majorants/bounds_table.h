#pragma once

#include <cstddef>
#include <vector>

#include "media/base/medium.h"

namespace nullmark {

/// Extrema of many cells of a medium.  Holds 24 bytes a cell where all channels are one grey field times factors; else 8, and 24
/// more for each channel.  The numbers that flights ask for lie together.
class BoundsTable {
 public:
  BoundsTable() = default;
  /// Of a medium: the extrema of `source` are put in.
  BoundsTable(const Medium& medium, std::size_t cells)
      : BoundsTable(medium.scaled() ? medium.scaled()->factors : Spectrum(Spectrum::Ones(medium.channels())),
                    medium.scaled() ? 1 : medium.channels(), cells) {}
  /// Each channel for itself.
  BoundsTable(int channels, std::size_t cells) : BoundsTable(Spectrum(Spectrum::Ones(channels)), channels, cells) {}

  /// The medium, or the grey field that its channels are factors of.
  static const Medium& source(const Medium& medium) { return medium.scaled() ? *medium.scaled()->grey : medium; }

  void put(std::size_t cell, const Extrema& extrema) {
    largest_[cell] = extrema.maximum.maxCoeff();
    for (std::size_t g = 0; g < groups_; ++g) {
      const auto channel = static_cast<Eigen::Index>(g);
      minimum_[cell * groups_ + g] = extrema.minimum[channel];
      average_[cell * groups_ + g] = extrema.average[channel];
      if (groups_ > 1) maximum_[cell * groups_ + g] = extrema.maximum[channel];
    }
  }

  /// The largest channel's bound, 1/length.
  Real largest(std::size_t cell) const { return scale_ * largest_[cell]; }

  Extrema operator[](std::size_t cell) const {
    const auto of = [&](const std::vector<Real>& values) -> Spectrum {
      if (groups_ == 1) return scaled(factors_, values[cell]);
      return Eigen::Map<const Spectrum>(&values[cell * groups_], factors_.size());
    };
    return {of(minimum_), of(average_), of(groups_ == 1 ? largest_ : maximum_)};
  }

  std::size_t cells() const { return largest_.size(); }
  std::size_t bytes() const { return (largest_.size() + minimum_.size() + average_.size() + maximum_.size()) * sizeof(Real); }

 private:
  BoundsTable(const Spectrum& factors, int groups, std::size_t cells)
      : factors_(factors),
        groups_(static_cast<std::size_t>(groups)),
        scale_(groups == 1 ? factors.maxCoeff() : 1),
        largest_(cells),
        minimum_(cells * groups_),
        average_(cells * groups_),
        maximum_(groups == 1 ? 0 : cells * groups_) {}

  Spectrum factors_ = Spectrum::Ones(1);
  std::size_t groups_ = 1;
  Real scale_ = 1;
  std::vector<Real> largest_;
  std::vector<Real> minimum_, average_, maximum_;  ///< [cell * groups + group]
};

}  // namespace nullmark

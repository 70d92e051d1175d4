#include "harness/statistics/moments.h"

#include <array>

#include "harness/statistics/double8.h"

namespace nullmark {
namespace {

Real sum_of_squares(std::span<const Real> x) {
  Eight sum = 0;
  std::size_t i = 0;
  for (; i + Eight::kCount <= x.size(); i += Eight::kCount) {
    const Eight each = Eight::load(&x[i]);
    sum += each * each;
  }
  Real result = total(sum);
  for (; i < x.size(); ++i) result += x[i] * x[i];
  return result;
}

/// sums[j] = x[2j] + x[2j + 1]; returns the sum of their squares.
Real add_pairs(const Real* x, std::size_t pairs, Real* sums) {
  Eight squares = 0;
  std::size_t j = 0;
  for (; j + Eight::kCount <= pairs; j += Eight::kCount) {
    const Eight sum = Eight::sums_of_pairs(x + 2 * j);
    sum.store(sums + j);
    squares += sum * sum;
  }
  Real result = total(squares);
  for (; j < pairs; ++j) {
    sums[j] = x[2 * j] + x[2 * j + 1];
    result += sums[j] * sums[j];
  }
  return result;
}

}  // namespace

void Moments::add(std::span<const Real> errors) {
  Eight first = 0, second = 0, third = 0, fourth = 0;
  std::size_t i = 0;
  for (; i + Eight::kCount <= errors.size(); i += Eight::kCount) {
    const Eight error = Eight::load(&errors[i]);
    const Eight square = error * error;
    first += error;
    second += square;
    third += square * error;
    fourth += square * square;
  }
  Moments sum{total(first), total(second), total(third), total(fourth), errors.size()};
  for (; i < errors.size(); ++i) {
    const Real square = errors[i] * errors[i];
    sum.s1 += errors[i];
    sum.s2 += square;
    sum.s3 += square * errors[i];
    sum.s4 += square * square;
  }
  *this += sum;
}

void BlockErrors::add(std::size_t ray, std::span<const Real> errors, Moments& moments) {
  // Fewer would leave registers empty.
  constexpr std::size_t kLeastRun = 64;
  const std::size_t run = errors.size() / kBlocks >= kLeastRun ? (errors.size() + kBlocks - 1) / kBlocks : errors.size();
  std::size_t block = run == errors.size() ? ray % kBlocks : 0;
  for (std::size_t first = 0; first < errors.size(); first += run, ++block) {
    Moments part;
    part.add(errors.subspan(first, std::min(run, errors.size() - first)));
    moments += part;
    squares[block] += part.s2;
    count[block] += part.count;
  }
}

/// Errors that are added together at once: their sums stay near.
constexpr std::size_t kFew = 1024;

void GroupErrors::add(std::span<const Real> errors) {
  for (std::size_t first = 0; first < errors.size(); first += kFew)
    add_few(errors.subspan(first, std::min(kFew, errors.size() - first)));
}

void GroupErrors::add_few(std::span<const Real> errors) {
  std::array<Real, kFew / 2> even;  // sums of the first, third, ... level
  std::array<Real, kFew / 4> odd;
  const Real* from = errors.data();
  std::size_t groups = errors.size(), level = 0;
  Real scale = 1;  // of squares: 4^-level
  for (Real squares = sum_of_squares(errors); groups > 1; ++level, scale /= 4) {
    reach(level);
    levels_[level].sum_of_squares += scale * squares;
    levels_[level].groups += groups;
    groups /= 2;
    Real* const to = level % 2 == 0 ? even.data() : odd.data();
    squares = add_pairs(from, groups, to);
    from = to;
  }
  carry(level, *from);
}

}  // namespace nullmark

// What a sheet's springs are to the kernels of filtered leapfrog.
#include <hooke/softbody/filtered_sheet.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace hooke::softbody {

namespace {

// Blocks of parameters, each different one kept once, and those of every block of the grid.
template <class S>
struct Blocks {
  std::map<std::vector<S>, std::size_t> number;
  std::vector<const std::vector<S>*> values;  // by number
  std::vector<std::size_t> used;              // by block of the grid

  void add(const std::vector<S>& block) {
    const auto [place, is_new] = number.emplace(block, values.size());
    if (is_new) values.push_back(&place->first);
    used.push_back(place->second);
  }

  // Takes one that is used so many blocks before instead, if it is the same but for rounding.
  bool add_as_before(const std::vector<S>& block, std::size_t before) {
    const auto same = [](S a, S b) { return std::abs(a - b) <= 256 * std::numeric_limits<S>::epsilon() * a; };
    if (before > used.size()) return false;
    const std::size_t there = used[used.size() - before];
    if (!std::equal(block.begin(), block.end(), values[there]->begin(), same)) return false;
    used.push_back(there);
    return true;
  }

  // Memory of them all, and where the grid's blocks are in it.
  void lay(Lines<S>& memory, std::vector<SheetSprings<S>>& blocks, const S* SheetSprings<S>::*at) const {
    const std::size_t size = values[0]->size();
    memory.resize(values.size() * size);
    for (std::size_t i = 0; i < values.size(); ++i)
      std::copy(values[i]->begin(), values[i]->end(), memory.data() + i * size);
    for (std::size_t i = 0; i < used.size(); ++i) blocks[i].*at = memory.data() + used[i] * size;
  }
};

}  // namespace

// In a sheet of one material nearly all blocks have the same stiffness, so that caches hold what is not the same.
template <class S>
void FilteredSheet<S>::lay_out_springs() {
  constexpr Index n = kLanes<S>;
  const Index blocks = stride_ / n;
  Blocks<S> all_stiffness, all_rest, all_inverse, all_damping;
  std::vector<S> difference(3 * n), square(n);
  const Points<S>& x = points_.position;
  for (Index r = 0; r < rows_; ++r)
    for (Index first = 0; first < stride_; first += n) {
      std::vector<S> stiffness(kDirections * n, S(0)), damping = stiffness, inverse = stiffness,
                                                       rest(kDirections * n, S(1));
      for (std::size_t d = 0; d < kDirections; ++d) {
        std::fill(difference.begin(), difference.end(), S(1));
        for (Index c = 0; c < std::min(n, columns_ - first); ++c) {
          const int i = plan_.grid.springs[d][std::size_t(r * columns_ + first + c)];
          if (i < 0) continue;
          const Spring& spring = plan_.network->springs[std::size_t(i)];
          const std::size_t at = d * n + std::size_t(c);
          stiffness[at] = S(spring.stiffness), damping[at] = S(spring.damping);
          for (int k = 0; k < 3; ++k)
            difference[std::size_t(k * n + c)] = spring.rest_length == Spring::kFromStart
                                                     ? x(spring.b, k) - x(spring.a, k)
                                                     : S(k == 0 ? spring.rest_length : 0);
        }
        sheet_squares(int(n), difference.data(), square.data());
        for (std::size_t c = 0; c < n; ++c) {
          const std::size_t at = d * n + c;
          rest[at] = square[c];
          inverse[at] = stiffness[at] == 0 ? S(0) : 1 / square[c];
        }
      }
      all_stiffness.add(stiffness), all_rest.add(rest), all_damping.add(damping);
      // Where two differ by the rounding of positions alone, one serves both: half of that is its share in the
      // stiffness, and nothing at rest, which the squares tell.
      if (!all_inverse.add_as_before(inverse, 1) && !all_inverse.add_as_before(inverse, std::size_t(blocks)))
        all_inverse.add(inverse);
    }
  springs_.resize(std::size_t(rows_ * blocks));
  all_stiffness.lay(stiffness_, springs_, &SheetSprings<S>::stiffness);
  all_rest.lay(rest_, springs_, &SheetSprings<S>::rest);
  all_inverse.lay(inverse_, springs_, &SheetSprings<S>::inverse);
  if (damped_) all_damping.lay(damping_, springs_, &SheetSprings<S>::damping);
}

template void FilteredSheet<float>::lay_out_springs();
template void FilteredSheet<double>::lay_out_springs();

}  // namespace hooke::softbody

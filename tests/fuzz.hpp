// Damage to files, for what must read or refuse them: HOOKE_SEED=S begins at a seed, HOOKE_FUZZ=N runs N rounds.
#pragma once

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>

namespace hooke::test {

/// HOOKE_SEED, or one of the machine's; printed, so that what fails can be run again.
inline std::uint64_t fuzz_seed() {
  const char* const given = std::getenv("HOOKE_SEED");
  const std::uint64_t seed = given ? std::strtoull(given, nullptr, 10) : std::random_device{}();
  std::printf("HOOKE_SEED=%llu\n", static_cast<unsigned long long>(seed));
  return seed;
}

/// HOOKE_FUZZ, or what a test does where nobody asks for more.
inline int fuzz_rounds(int usual) {
  const char* const wanted = std::getenv("HOOKE_FUZZ");
  return wanted ? std::atoi(wanted) : usual;
}

class Damage {
 public:
  explicit Damage(std::uint64_t seed) : random_(std::mt19937::result_type(seed)) {}

  std::size_t below(std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(random_); }

  /// Bytes changed, cut, doubled or swapped for one of those that matter to the format.
  std::string operator()(std::string text, const std::string& special) {
    for (std::size_t i = 0, n = 1 + below(4); i < n && !text.empty(); ++i) {
      const std::size_t at = below(text.size());
      switch (below(6)) {
        case 0:
          text[at] = char(below(256));
          break;
        case 1:
          text.erase(at, 1 + below(10));
          break;
        case 2:
          text.insert(at, text.substr(below(text.size()), below(40)));
          break;
        case 3:
          // Seldom: what is cut short says little more than where.
          if (below(4) == 0) text.resize(at);
          break;
        case 4:
          text.insert(at, 1, special[below(special.size())]);
          break;
        default:
          text[at] = char(text[at] ^ char(1 << below(8)));
      }
    }
    return text;
  }

 private:
  std::mt19937 random_;
};

}  // namespace hooke::test

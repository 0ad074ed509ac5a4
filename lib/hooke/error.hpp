// The exception for everything that comes from outside: files, scenes, outputs.
// Wrong arguments from C++ callers are std::invalid_argument.
#pragma once

#include <stdexcept>

namespace hooke {

/// Bad input: a file that is missing, truncated or not what it claims, or a scene value
/// that breaks a rule. The text names the file, the key, the rule and the value.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// An output could not be written (no space, no permission).
class OutputError : public Error {
 public:
  using Error::Error;
};

}  // namespace hooke

// What the library objects to, told with the place in the file.
#pragma once

#include <hooke/error.hpp>

#include <stdexcept>
#include <string>

namespace hooke::scene {

[[noreturn]] inline void fail_at(const std::string& file, const std::string& path, const std::string& rule) {
  throw Error(file + ": " + path + ": " + rule);
}

/// work(); what it throws for bad input becomes a hooke::Error "FILE: PATH: …".
template <class Work>
auto told_at(const std::string& file, const std::string& path, const Work& work) {
  try {
    return work();
  } catch (const Error& error) {
    fail_at(file, path, error.what());
  } catch (const std::invalid_argument& error) {
    fail_at(file, path, error.what());
  } catch (const std::out_of_range& error) {
    fail_at(file, path, error.what());
  }
}

}  // namespace hooke::scene

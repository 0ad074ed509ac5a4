#include "commands.hpp"

#include <hooke/error.hpp>

namespace hooke::command {

int render(const RenderOptions&) { throw Error("not yet"); }

}  // namespace hooke::command

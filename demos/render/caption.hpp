// A few lines of text in the bottom left corner of a finished picture.
#pragma once

#include <render/image.hpp>

#include <string>
#include <vector>

namespace hooke::render {

/// Draws `lines` on a soft dark strip in the bottom left corner. The size follows the
/// picture's height (26 lines of 720 pixels would fill it); lines that are too long are
/// cut. The font holds ASCII 32 to 126; any other character shows as '?'. No lines, no strip. `scale` makes it
/// larger, for pictures that become part of one.
void draw_caption(Image& image, const std::vector<std::string>& lines, double scale = 1);

/// Draws one line of light text, `dot` [pixels] the eighth of its height; (x, y) is its top left corner.
void draw_text(Image& image, const std::string& line, double x, double y, double dot);

}  // namespace hooke::render

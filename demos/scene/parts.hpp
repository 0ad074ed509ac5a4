// Readers of what several kinds of objects in a scene file have.
#pragma once

#include <scene/drive.hpp>
#include <scene/reader.hpp>

namespace hooke::scene {

Range fraction();                         ///< from 0 to 1
Vec3 read_color(const Value& value);      ///< linear RGB
Vec3 read_direction(const Value& value);  ///< of any length
/// translate, swing and keys of an opened object.
Drive read_drive(const Object& object);

}  // namespace hooke::scene

#include <scene/parts.hpp>

namespace hooke::scene {

Range fraction() { return Range::between(0, 1, "from 0 to 1"); }

Vec3 read_color(const Value& value) {
  if (value.array() != 3) value.fail_got("must be an array of 3 numbers from 0 to 1");
  return {value.at(0).number(fraction()), value.at(1).number(fraction()), value.at(2).number(fraction())};
}

Vec3 read_direction(const Value& value) {
  const Vec3 direction = value.vec3();
  if (!(direction.norm() > 1e-9) || !(direction.norm() < 1e150)) value.fail("must be a direction, not of length 0");
  return direction;
}

Drive read_drive(const Object& object) {
  Drive drive;
  if (const auto keys = object.find("keys")) {
    if (object.has("translate") || object.has("swing")) keys->fail("excludes translate and swing");
    if (keys->array() == 0) keys->fail("must have at least one key");
    for (std::size_t i = 0; i < keys->array(); ++i) {
      const Object key(keys->at(i), "key");
      drive.keys.push_back({key["time"].number(), key["offset"].vec3()});
      if (i > 0 && !(drive.keys[i].time > drive.keys[i - 1].time))
        key["time"].fail_got("must be later than the key before, " + std::to_string(drive.keys[i - 1].time) + " s");
    }
    return drive;
  }
  if (!object.has("translate") && !object.has("swing")) object.value().fail("needs translate, swing or keys");
  drive.translate = object.vec3("translate", Vec3::Zero());
  if (const auto found = object.find("swing")) {
    const Object swing(*found, "swing");
    drive.swing = swing["amplitude"].vec3();
    drive.period = swing["period"].number(Range::positive(), "s");
  }
  return drive;
}

}  // namespace hooke::scene

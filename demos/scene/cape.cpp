#include <scene/cape.hpp>

namespace hooke::scene {

Cape dress(const human::Human& human, const CapeSettings& s, double t0) {
  Cape cape;
  cape.cloth = softbody::cloth_from_grid(s.width, s.height, s.columns, s.rows, {-1, 0, 0}, {0, -1, 0}, s.material);
  cape.cloth.positions.rowwise() += Vec3(0, 1.45, -0.25).transpose().array();
  for (int c = 0; c < s.columns; ++c) cape.pins.push_back(c);
  Points<double> pinned(Index(cape.pins.size()), 3);
  for (std::size_t i = 0; i < cape.pins.size(); ++i) pinned.row(Index(i)) = cape.cloth.positions.row(cape.pins[i]);
  cape.attachment = human.attach(pinned, t0);
  return cape;
}

}  // namespace hooke::scene

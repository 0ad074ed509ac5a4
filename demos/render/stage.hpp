// The photographer's studio: a seamless floor, three lights, and a picture of whatever
// meshes stand in it. y is up, the floor is y = 0, lengths are metres.
#pragma once

#include <render/camera.hpp>
#include <render/image.hpp>
#include <render/particles.hpp>

#include <hooke/types.hpp>

#include <Eigen/Core>

#include <memory>
#include <span>
#include <string>
#include <vector>

namespace hooke::render {

/// One (u, v) pair a vertex: the place in the cloth as it was cut [m], shape (n, 2).
using TextureCoordinates = Eigen::Array<double, Eigen::Dynamic, 2>;

/// What a surface looks like. Colours are linear RGB reflectances in [0, 1].
struct Material {
  enum class Kind {
    Matte,  ///< one smooth opaque surface with a soft highlight
    Cloth,  ///< woven: sheen at grazing angles, lining, thread detail, stitched hem
    Stone,  ///< sandstone, its layers and grains where it stands in the studio; must not move
    Metal,  ///< brushed around the vertical; mirrors the studio
    Water,  ///< clear: bends what is behind, mirrors the studio and the picture; throws no shadow
    Jelly   ///< closed and clear with a glow inside: bends what is behind and throws a coloured shadow. Where it is
            ///< subdivided, its edges are rounded
  };
  Kind kind = Kind::Matte;
  /// Outside; the default is a warm grey mannequin. Water: what 10 cm of it leave of light; jelly: 5 cm.
  Vec3 color{0.38, 0.35, 0.32};
  Vec3 inside_color{0.105, 0.045, 0.060};  ///< what back faces show (cloth: the lining)
  Vec3 sheen{0.30, 0.12, 0.11};            ///< cloth: colour of the fuzz at grazing angles
  double roughness = 0.55;  ///< in (0, 1]; higher spreads and dims the highlight (matte) or sheen (cloth)
  double weave = 700;       ///< cloth: threads per metre, 0 for none; drawn only where the model has uv
  double wetness = 0;       ///< stone: in [0, 1]; wet stone is darker and shines
  bool stream = false;  ///< water: thin and round, so that its far side bends light too; else a body's upper surface
};

/// Materials with the studio's values for them.
Material water();      ///< clear, a little blue-green
Material sandstone();  ///< warm, dry
Material steel();      ///< brushed
Material jelly();      ///< raspberry

/// A mesh and how to draw it. What the pointers name must live until draw() returns.
/// Normals are computed from the mesh in every picture.
struct Model {
  const TriangleMesh* mesh = nullptr;  ///< required; triangles counter-clockwise seen from outside
  Material material{};
  /// Optional, one number in [0, 1] a vertex. Water: how much foam lies there (null: none).
  /// Stone: multiplies the material's wetness (null: 1).
  const Values<float>* cover = nullptr;
  const TextureCoordinates* uv = nullptr;  ///< optional, one row a vertex [m]: ties the weave to the cloth
  double thickness = 0;  ///< [m]; above 0 two sheets at ± half of it are drawn, closed by a rounded hem
  int subdivisions = 0;  ///< 0 to 2: rounds the mesh between its vertices, four times the triangles each
};

/// The light in the studio.
struct Look {
  Vec3 key_direction{-0.66, 0.70, 0.34};  ///< from the subject towards the large soft light; any length
  double key_intensity = 1;               ///< relative to the studio's setting
  double key_size = 0.22;                 ///< angle the light fills, seen from the subject [rad]: softness of shadows
  Vec3 rim_direction{0.62, 0.42, -0.66};  ///< towards the cool light behind the subject; any length
  double rim_intensity = 1;
  double fill_intensity = 1;           ///< light from all around
  double bloom = 0.18;                 ///< share of the sparks' light that spreads in the lens, in [0, 1]
  double exposure = 1;                 ///< multiplies everything before tone mapping
  Vec3 floor_color{0.36, 0.36, 0.37};  ///< linear RGB reflectance of the floor
};

/// The default look turned so that, for `camera`, the key light comes from the left and
/// above and the rim light from behind right. Keep one look for a shot, or shadows turn.
Look look_for(const Camera& camera);

/// The same in a dim workshop with a dark floor, where sparks light the scene.
Look workshop_for(const Camera& camera);

/// Draws pictures of one size. Owns an off-screen OpenGL context (software; no display or
/// GPU needed), so it must not be used by two threads at once; it may move between threads.
/// The same arguments give the same bytes, whatever was drawn before.
class Stage {
 public:
  /// `width`, `height` [pixels] from 1 to 8192; `supersample` from 1 to 4 draws that many
  /// times larger each way and averages (on top of the four samples a pixel there are
  /// always). Throws std::invalid_argument for other values, hooke::Error with the
  /// driver's words if OpenGL does not start.
  Stage(int width, int height, int supersample = 1, const Look& look = {});
  ~Stage();
  Stage(Stage&&) noexcept;
  Stage& operator=(Stage&&) noexcept;

  void set_look(const Look& look);

  /// The picture of `models` seen by `camera`, with `caption_lines` on a strip in the
  /// bottom left corner. Connectivity and uv are uploaded again only when they change, by
  /// place in `models`, so keep the order from frame to frame. Throws std::invalid_argument
  /// naming the model and vertex if a coordinate is not finite or an index out of range.
  Image draw(std::span<const Model> models, const Camera& camera, const std::vector<std::string>& caption_lines = {});

  /// The same with particles, which also light the models and the floor. Without any, or
  /// with empty ones only, the picture is that of the other draw(), to the byte. Smoke and drops are
  /// sorted; the order they are given in does not show. Throws std::invalid_argument naming the
  /// particles, the array and the index of what cannot be drawn.
  Image draw(std::span<const Model> models, std::span<const Particles> particles, const Camera& camera,
             const std::vector<std::string>& caption_lines = {});

 private:
  struct Studio;
  std::unique_ptr<Studio> studio_;
};

}  // namespace hooke::render

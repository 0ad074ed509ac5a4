// Turns a simulated mesh into what is drawn: smooth normals and, for cloth, two sheets
// with a rounded hem. No OpenGL here.
#pragma once

#include <render/stage.hpp>

#include <cstdint>
#include <vector>

namespace hooke::render {

/// One vertex as the shaders read it.
struct SurfaceVertex {
  float position[3];  ///< [m]
  float normal[3];    ///< unit
  float uv[2];        ///< along the cloth [m]
  float side;         ///< 0 outside, 1 inside; water and stone: the model's cover
  float hem;          ///< distance to the border along the cloth [m]; large where there is none
};

/// The drawn form of one mesh. Everything that depends only on connectivity is worked out
/// once, in the constructor; update() moves the vertices.
class Surface {
 public:
  /// Throws std::invalid_argument for indices or uv that do not fit the mesh.
  explicit Surface(const Model& model);

  /// Whether `model` differs from the one this was made of only in its vertex positions
  /// and colours.
  bool fits(const Model& model) const;

  /// Recomputes positions and normals. Throws std::invalid_argument that names the vertex
  /// if a coordinate is not finite.
  void update(const Points<double>& vertices);
  /// Sets the vertices' cover: `values` (one a given vertex, throws std::invalid_argument if
  /// not, or outside [0, 1]), or `otherwise` everywhere if null.
  void set_cover(const Values<float>* values, float otherwise);

  const std::vector<SurfaceVertex>& vertices() const { return drawn_; }
  const std::vector<std::uint32_t>& indices() const { return indices_; }
  /// A run of indices().
  struct Range {
    std::size_t first, count;
  };
  /// What is seen.
  Range all() const { return {0, indices_.size() - coarse_count_}; }
  /// The outer sheet, which is enough to cast shadows.
  Range sheet() const { return {0, 3 * sheet_.size()}; }
  /// The outer sheet with few triangles, enough to dim the light from all around.
  Range coarse() const { return {indices_.size() - coarse_count_, coarse_count_}; }
  const Vec3& lower() const { return lower_; }  ///< bounding box after update() [m]
  const Vec3& upper() const { return upper_; }

 private:
  struct Edge {
    int a, b;
    int left = -1, right = -1;  // the corners opposite it; right: -1 on a border
  };
  void subdivide();
  void find_border();
  void measure_hem();
  void index_sheets();
  void index_coarse();
  void round_off(std::size_t level, const std::vector<Vec3>& coarse);
  void write_sheets();

  std::vector<Triangle> given_;  // as the model has them
  Index given_count_ = 0;
  TextureCoordinates given_uv_;
  double thickness_ = 0;
  int subdivisions_ = 0;
  bool rounded_ = false;

  std::vector<std::vector<Edge>> midpoints_;            // one list of split edges a subdivision
  std::vector<std::vector<Triangle>> level_triangles_;  // before each subdivision
  std::vector<Triangle> sheet_;                         // after all of them
  std::vector<Eigen::Vector2d> uv_;
  std::vector<Edge> border_;  // directed, interior on the left seen from outside
  std::vector<int> border_vertices_;
  std::vector<int> border_slot_;  // vertex -> place in border_vertices_, or -1
  std::vector<float> hem_;
  std::vector<std::uint32_t> indices_;
  std::size_t coarse_count_ = 0;

  std::vector<Vec3> position_, normal_;
  std::vector<SurfaceVertex> drawn_;
  Vec3 lower_{0, 0, 0}, upper_{0, 0, 0};
};

}  // namespace hooke::render

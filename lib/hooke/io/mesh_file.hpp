// Meshes from files that other programs write.
#pragma once

#include <hooke/types.hpp>

#include <filesystem>

namespace hooke::io {

/// The triangles of a Wavefront OBJ file, all groups together. Vertices keep the file's order,
/// also those that no face uses; polygons are cut into triangles; textures, normals, materials,
/// lines and points are passed over. Throws hooke::Error naming the file, the line and the
/// rule: missing or unreadable file, no OBJ, no vertices, no faces, a coordinate that is missing
/// or not finite, a face of fewer than three corners, an index outside the vertices.
TriangleMesh read_obj(const std::filesystem::path& path);

}  // namespace hooke::io

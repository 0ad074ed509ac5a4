#include <hooke/error.hpp>
#include <hooke/vdb/grids.hpp>

#include <openvdb/io/Archive.h>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <system_error>

namespace hooke::vdb {

namespace {

// OpenVDB's own File does not tell when the disk is full: the stream is ours.
class Writer : public openvdb::io::Archive {
 public:
  void write_to(std::ostream& out, const openvdb::GridCPtrVec& grids) const {
    write(out, grids, /*seekable=*/true, openvdb::MetaMap());
  }
};

// The header has a random number for each file: instead, one that follows from the content.
constexpr std::streamoff kUniqueAt = 21;
constexpr std::size_t kUniqueLength = 36;

void settle_identity(std::fstream& file) {
  std::uint64_t hash[2] = {0xcbf29ce484222325u, 0x84222325cbf29ce4u};
  std::vector<char> block(1 << 20);
  file.seekg(kUniqueAt + std::streamoff(kUniqueLength));
  while (file.read(block.data(), std::streamsize(block.size())) || file.gcount() > 0)
    for (std::streamsize i = 0; i < file.gcount(); ++i) {
      const auto byte = static_cast<unsigned char>(block[std::size_t(i)]);
      hash[0] = (hash[0] ^ byte) * 0x100000001b3u;  // FNV-1a
      hash[1] = (hash[1] + byte) * 0x9e3779b97f4a7c15u;
    }
  file.clear();
  std::string text;
  for (std::size_t digit = 0; text.size() < kUniqueLength; ++digit) {
    if (digit == 8 || digit == 12 || digit == 16 || digit == 20) text += '-';
    text += "0123456789abcdef"[hash[digit / 16] >> (digit % 16 * 4) & 15];
  }
  file.seekp(kUniqueAt);
  file.write(text.data(), std::streamsize(text.size()));
  file.flush();
}

}  // namespace

void write_grids(const std::filesystem::path& path, const openvdb::GridCPtrVec& grids) {
  std::filesystem::path part = path.parent_path() / path.stem();
  part += ".part";
  part += path.extension();
  const auto fail = [&](const char* action, const std::string& reason) {
    std::error_code ignored;
    std::filesystem::remove(part, ignored);
    throw OutputError(path.string() + ": cannot " + action + ": " + reason);
  };
  std::fstream file(part, std::ios::binary | std::ios::trunc | std::ios::in | std::ios::out);
  if (!file) fail("open", std::strerror(errno));
  try {
    errno = 0;
    Writer().write_to(file, grids);
    file.flush();
  } catch (const std::exception& error) {
    file.close();
    fail("write", error.what());
  }
  if (file) settle_identity(file);
  const bool good = file.good();
  file.close();
  if (!good || !file) fail("write", errno ? std::strerror(errno) : "the file could not be completed");
  std::error_code error;
  std::filesystem::rename(part, path, error);
  if (error) fail("rename", error.message());
}

openvdb::math::Transform::Ptr transform_of(double voxel, const Vec3& origin) {
  auto transform = openvdb::math::Transform::createLinearTransform(voxel);
  transform->postTranslate({origin.x(), origin.y(), origin.z()});
  return transform;
}

}  // namespace hooke::vdb

// The few OpenGL objects that the studio needs. Included by stage.cpp and context.cpp only.
#pragma once

#define GL_GLEXT_PROTOTYPES
#include <GL/osmesa.h>

#include <GL/glext.h>

#include <Eigen/Core>

#include <array>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace hooke::render::gl {

/// An off-screen core profile context. Everything made in it dies with it, so the objects
/// below have no destructors of their own.
class Context {
 public:
  Context();
  ~Context();
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  /// Lets this thread use the context for as long as the returned object lives.
  class Current {
   public:
    explicit Current(Context& context);
    ~Current();
    Current(const Current&) = delete;
    Current& operator=(const Current&) = delete;
  };

 private:
  OSMesaContext handle_;
  // OSMesa wants a window's worth of memory; we only ever draw into textures.
  std::array<unsigned char, 16 * 16 * 4> window_{};
};

/// Throws hooke::Error with the code if OpenGL has recorded an error.
void check(const char* where);

/// A linked pair of shaders. Uniforms are looked up by name once.
class Program {
 public:
  Program() = default;
  explicit operator bool() const { return id_ != 0; }
  /// `name` appears in the error text if a shader does not compile.
  Program(const char* name, const std::string& vertex_source, const std::string& fragment_source);

  void use() const;
  void set(const char* name, int value);
  void set(const char* name, float value);
  void set(const char* name, double value) { set(name, static_cast<float>(value)); }
  void set(const char* name, const Eigen::Vector2f& value);
  void set(const char* name, const Eigen::Vector3d& value);
  void set(const char* name, const Eigen::Matrix4f& value);
  void set(const char* name, std::span<const Eigen::Matrix4f> values);
  void set(const char* name, std::span<const Eigen::Vector3f> values);
  void set(const char* name, std::span<const Eigen::Vector4f> values);
  /// Binds a texture to a unit and the sampler of that name to the unit.
  void set_texture(const char* name, int unit, GLenum target, GLuint texture);

 private:
  GLint place(const char* name);
  GLuint id_ = 0;
  std::map<std::string, GLint, std::less<>> places_;
};

/// A two-dimensional texture without mipmaps; `samples` > 0 makes it multisampled.
GLuint make_texture(GLenum format, int width, int height, GLenum filter, int samples = 0);

/// A depth texture that can be compared in hardware (linear) or read as numbers, through
/// the two sampler objects of the stage.
GLuint make_depth_map(int width, int height);

/// A framebuffer with the given textures (0 for none). Throws hooke::Error if incomplete.
GLuint make_framebuffer(GLenum target, GLuint color, GLuint depth);

}  // namespace hooke::render::gl

#include <render/context.hpp>

#include <hooke/error.hpp>

namespace hooke::render::gl {

Context::Context() {
  const int attributes[] = {OSMESA_FORMAT,
                            OSMESA_RGBA,
                            OSMESA_DEPTH_BITS,
                            0,
                            OSMESA_PROFILE,
                            OSMESA_CORE_PROFILE,
                            OSMESA_CONTEXT_MAJOR_VERSION,
                            3,
                            OSMESA_CONTEXT_MINOR_VERSION,
                            3,
                            0,
                            0};
  handle_ = OSMesaCreateContextAttribs(attributes, nullptr);
  if (!handle_) throw Error("Stage: OSMesa gives no OpenGL 3.3 core context");
}

Context::~Context() { OSMesaDestroyContext(handle_); }

Context::Current::Current(Context& context) {
  if (!OSMesaMakeCurrent(context.handle_, context.window_.data(), GL_UNSIGNED_BYTE, 16, 16))
    throw Error("Stage: OSMesa cannot make its context current");
}

Context::Current::~Current() { OSMesaMakeCurrent(nullptr, nullptr, GL_UNSIGNED_BYTE, 0, 0); }

void check(const char* where) {
  if (const GLenum code = glGetError(); code != GL_NO_ERROR) {
    char text[16];
    std::snprintf(text, sizeof text, "0x%04x", code);
    throw Error(std::string("Stage: OpenGL error ") + text + " in " + where);
  }
}

namespace {

GLuint compile(const char* name, GLenum kind, const std::string& source) {
  const GLuint shader = glCreateShader(kind);
  const char* text = source.c_str();
  glShaderSource(shader, 1, &text, nullptr);
  glCompileShader(shader);
  GLint ok = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &ok);
  if (!ok) {
    std::string log(4096, '\0');
    GLsizei length = 0;
    glGetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), &length, log.data());
    log.resize(static_cast<std::size_t>(length));
    throw Error(std::string("Stage: the ") + (kind == GL_VERTEX_SHADER ? "vertex" : "fragment") + " shader of '" +
                name + "' does not compile: " + log);
  }
  return shader;
}

}  // namespace

Program::Program(const char* name, const std::string& vertex_source, const std::string& fragment_source)
    : id_(glCreateProgram()) {
  for (const GLuint shader :
       {compile(name, GL_VERTEX_SHADER, vertex_source), compile(name, GL_FRAGMENT_SHADER, fragment_source)}) {
    glAttachShader(id_, shader);
    glDeleteShader(shader);  // once the program goes
  }
  glLinkProgram(id_);
  GLint ok = 0;
  glGetProgramiv(id_, GL_LINK_STATUS, &ok);
  if (!ok) {
    std::string log(4096, '\0');
    GLsizei length = 0;
    glGetProgramInfoLog(id_, static_cast<GLsizei>(log.size()), &length, log.data());
    log.resize(static_cast<std::size_t>(length));
    throw Error(std::string("Stage: the program '") + name + "' does not link: " + log);
  }
}

GLint Program::place(const char* name) {
  if (const auto found = places_.find(name); found != places_.end()) return found->second;
  return places_[name] = glGetUniformLocation(id_, name);  // -1 (optimized away) is ignored by glUniform
}

void Program::use() const { glUseProgram(id_); }
void Program::set(const char* name, int value) { glUniform1i(place(name), value); }
void Program::set(const char* name, float value) { glUniform1f(place(name), value); }
void Program::set(const char* name, const Eigen::Vector2f& value) { glUniform2fv(place(name), 1, value.data()); }
void Program::set(const char* name, const Eigen::Vector3d& value) {
  const Eigen::Vector3f single = value.cast<float>();
  glUniform3fv(place(name), 1, single.data());
}
void Program::set(const char* name, const Eigen::Matrix4f& value) {
  glUniformMatrix4fv(place(name), 1, GL_FALSE, value.data());
}
void Program::set(const char* name, std::span<const Eigen::Matrix4f> values) {
  glUniformMatrix4fv(place(name), static_cast<GLsizei>(values.size()), GL_FALSE, values.front().data());
}
void Program::set(const char* name, std::span<const Eigen::Vector3f> values) {
  glUniform3fv(place(name), static_cast<GLsizei>(values.size()), values.front().data());
}
void Program::set(const char* name, std::span<const Eigen::Vector4f> values) {
  glUniform4fv(place(name), static_cast<GLsizei>(values.size()), values.front().data());
}
void Program::set_texture(const char* name, int unit, GLenum target, GLuint texture) {
  glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
  glBindTexture(target, texture);
  set(name, unit);
}

GLuint make_texture(GLenum format, int width, int height, GLenum filter, int samples) {
  GLuint texture = 0;
  glGenTextures(1, &texture);
  const bool depth = format == GL_DEPTH_COMPONENT32F;
  if (samples > 0) {
    glBindTexture(GL_TEXTURE_2D_MULTISAMPLE, texture);
    glTexImage2DMultisample(GL_TEXTURE_2D_MULTISAMPLE, samples, format, width, height, GL_TRUE);
  } else {
    glBindTexture(GL_TEXTURE_2D, texture);
    glTexImage2D(GL_TEXTURE_2D, 0, static_cast<GLint>(format), width, height, 0, depth ? GL_DEPTH_COMPONENT : GL_RGBA,
                 GL_FLOAT, nullptr);
    for (const GLenum which : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
      glTexParameteri(GL_TEXTURE_2D, which, static_cast<GLint>(filter));
    for (const GLenum which : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T})
      glTexParameteri(GL_TEXTURE_2D, which, GL_CLAMP_TO_EDGE);
  }
  check("make_texture");
  return texture;
}

GLuint make_depth_map(int width, int height) { return make_texture(GL_DEPTH_COMPONENT32F, width, height, GL_NEAREST); }

GLuint make_framebuffer(GLenum target, GLuint color, GLuint depth) {
  GLuint framebuffer = 0;
  glGenFramebuffers(1, &framebuffer);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  if (color)
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, target, color, 0);
  else {
    glDrawBuffer(GL_NONE);
    glReadBuffer(GL_NONE);
  }
  if (depth) glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, target, depth, 0);
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    throw Error("Stage: OpenGL cannot draw into a texture of this size or format");
  return framebuffer;
}

}  // namespace hooke::render::gl

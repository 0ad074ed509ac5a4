#include <render/shaders.hpp>

namespace hooke::render {

namespace {

const char* const kVersion = "#version 330 core\n";

// A place on the floor is found from two numbers: an angle and a distance along the floor's
// profile, which is flat out to 1, turns up along a quarter circle, and goes on as a wall.
const char* const kFloorVertex = R"(
layout(location = 0) in vec3 profile;  // direction (x, z), place along the profile
uniform mat4 to_clip;
uniform vec3 floor_center;
uniform float floor_radius;
centroid out vec3 place;
centroid out vec3 facing;
centroid out vec2 cloth_place;
centroid out float side;
centroid out float hem;
void main() {
  float t = profile.z, r = t, y = 0.0;
  const float sweep = 1.5, quarter = 1.5707963;
  if (t > 1.0) {
    float angle = min((t - 1.0) / sweep, quarter);
    r = 1.0 + sweep * sin(angle);
    y = sweep * (1.0 - cos(angle)) + max(0.0, t - 1.0 - sweep * quarter);
  }
  place = floor_center + floor_radius * vec3(profile.x * r, y, profile.y * r);
  facing = vec3(0, 1, 0);
  cloth_place = vec2(t, 0);
  side = 0.0;
  hem = 1e3;
  gl_Position = to_clip * vec4(place, 1);
})";

const char* const kSurfaceVertex = R"(
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec2 uv;
layout(location = 3) in vec2 side_hem;
uniform mat4 to_clip;
centroid out vec3 place;
centroid out vec3 facing;
centroid out vec2 cloth_place;
centroid out float side;
centroid out float hem;
void main() {
  place = position;
  facing = normal;
  cloth_place = uv;
  side = side_hem.x;
  hem = side_hem.y;
  gl_Position = to_clip * vec4(position, 1);
})";

const char* const kDepthVertex = R"(
layout(location = 0) in vec3 position;
uniform mat4 to_clip;
void main() { gl_Position = to_clip * vec4(position, 1); })";

// What the visibility pass needs to know of a pixel: where the surface is, how it faces.
const char* const kPrepass = R"(
centroid in vec3 place;
centroid in vec3 facing;
uniform vec3 eye, forward;
uniform int two_sided;
out vec4 normal_depth;
void main() {
  vec3 n = normalize(facing);
  if (two_sided == 1 && !gl_FrontFacing) n = -n;
  normal_depth = vec4(n, dot(place - eye, forward));
})";

const char* const kFullScreenVertex = R"(
void main() {
  gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0, 1);
})";

// Shared by the passes that read the prepass: where the surface under a pixel is.
const char* const kPlaceOfPixel = R"(
uniform sampler2D normal_depth;
uniform vec3 eye, forward, ray_right, ray_up;  // rays span [-1, 1] over the picture
uniform vec2 picture;                          // pixels
vec3 place_at(vec2 pixel, float depth) {
  vec2 s = 2.0 * pixel / picture - 1.0;
  return eye + depth * (forward + s.x * ray_right + s.y * ray_up);
}
)";

// How much of each light a pixel sees: (key, rim, light from above, light from below).
// Sample patterns are turned by one of sixteen angles in a fixed 4 x 4 tile, and the blur
// that follows averages over whole tiles: no noise stays on a smooth surface, and nothing
// changes from frame to frame. A software driver runs both sides of an if but leaves a
// loop as soon as it can, so what is costly hangs on loop counts.
const char* const kVisibility = R"(
uniform sampler2D key_depth;
uniform sampler2DShadow rim_shadow, dome_shadow;
uniform mat4 to_key, to_rim, to_dome[DOME];
uniform vec3 key_direction, rim_direction, dome_direction[DOME];
uniform vec3 key_extent, rim_extent;  // half size of the lit boxes [m]
uniform float dome_reach;             // half width of a dome tile [m]
uniform float key_tan;                // tangent of half the angle the key light fills
uniform vec3 subject;                 // middle of what casts shadows [m]
uniform float subject_radius;
out vec4 visible;

const float golden = 2.399963;

// Soft shadow in the manner of percentage-closer soft shadows (Fernando 2005): the nearer
// what blocks the light, the sharper. A sample counts only if what lies there can cover a
// part of the light as seen from here; without that, high blockers would widen the disc
// until low ones fall in, and shadows would have steps.
float soft_shadow(vec3 p, vec3 n, float turn, float jitter) {
  float facing = dot(n, key_direction);
  float slope = sqrt(max(0.0, 1.0 - facing * facing));
  p += n * (0.0015 + 0.005 * slope);
  vec3 c = (to_key * vec4(p, 1)).xyz * 0.5 + 0.5;
  float depth = min(c.z, 0.9999);
  vec2 per_metre = 0.5 / key_extent.xy;
  // The plane of the surface: how depth changes across the disc of samples.
  vec3 right = vec3(to_key[0][0], to_key[1][0], to_key[2][0]) * key_extent.x;
  vec3 up = vec3(to_key[0][1], to_key[1][1], to_key[2][1]) * key_extent.y;
  vec2 tilt = vec2(dot(n, right), dot(n, up)) / max(facing, 0.15);  // metres of depth, a metre across
  float metres = 2.0 * key_extent.z, bias = 0.0012;
  float reach = clamp(key_tan * depth * metres, 0.004, 0.30);
  bool in_map = facing > 0.0 && all(lessThan(abs(c.xy - 0.5), vec2(0.5)));

  float weight = 0.0, sum = 0.0;
  int search = in_map ? 10 : 0;  // denser towards the middle, where low blockers have to be
  for (int i = 0; i < search; ++i) {
    float u = (float(i) + jitter) / 10.0, r = reach * u * u, a = float(i) * golden + turn;
    vec2 o = r * vec2(cos(a), sin(a));
    float gap = (depth - texture(key_depth, c.xy + o * per_metre).r) * metres + clamp(dot(tilt, o), -0.15, 0.15) - bias;
    float w = gap > 0.0 ? clamp((key_tan * gap - 0.5 * r) / (0.3 * r + 1e-4), 0.0, 1.0) : 0.0;
    w /= (gap + 0.03);
    weight += w;
    sum += w * gap;
  }
  int taps = weight > 0.0 ? 14 : 0;
  float radius = clamp(key_tan * sum / max(weight, 1e-6), 0.003, reach);
  float hidden = 0.0;
  for (int i = 0; i < taps; ++i) {
    float r = radius * sqrt((float(i) + jitter) / 14.0), a = float(i) * golden + turn;
    vec2 o = r * vec2(cos(a), sin(a));
    float gap = (depth - texture(key_depth, c.xy + o * per_metre).r) * metres + clamp(dot(tilt, o), -0.15, 0.15) - bias;
    hidden += gap > 0.0 ? clamp((key_tan * gap + 0.002 - 0.75 * r) / (0.25 * r + 0.001), 0.0, 1.0) : 0.0;
  }
  return 1.0 - hidden / 14.0;
}

float rim_light(vec3 p, vec3 n, float turn, float jitter) {
  if (dot(n, rim_direction) <= 0.0) return 1.0;
  p += n * 0.008;
  vec3 c = (to_rim * vec4(p, 1)).xyz * 0.5 + 0.5;
  if (any(greaterThan(abs(c.xy - 0.5), vec2(0.5)))) return 1.0;
  float here = min(c.z, 0.9999) - 0.002 / key_extent.z;
  float lit = 0.0;
  for (int i = 0; i < 4; ++i) {
    float r = sqrt((float(i) + jitter) / 4.0), a = float(i) * golden + turn;
    lit += texture(rim_shadow, vec3(c.xy + 0.02 * r * vec2(cos(a), sin(a)) / rim_extent.xy, here));
  }
  return lit / 4.0;
}

// Light from all around, as parallel lights that each have a small depth map. Every other
// pixel asks every other light; the blur brings them together.
vec2 dome_light(vec3 p, vec3 n, float turn, float jitter, int first) {
  float seen[2] = float[2](0.0, 0.0), all[2] = float[2](1e-4, 1e-4);
  p += n * 0.012;
  float spread = mix(0.015, 0.05, clamp(length(p - subject) / (2.0 * subject_radius), 0.0, 1.0));
  int lights = n.y > 0.999 ? DOME_UP : DOME;
  for (int k = first; k < lights; k += 2) {
    float weight = dot(n, dome_direction[k]);
    int half_of = k < DOME_UP ? 0 : 1;
    if (weight <= 0.0) continue;
    all[half_of] += weight;
    vec3 c = (to_dome[k] * vec4(p, 1)).xyz * 0.5 + 0.5;
    float a = turn + float(k) * golden, r = sqrt(fract(jitter + float(k) * 0.618034));
    c.xy += spread * r * vec2(cos(a), sin(a)) / dome_reach;
    if (any(greaterThan(abs(c.xy - 0.5), vec2(0.496)))) { seen[half_of] += weight; continue; }
    vec2 tile = vec2(k % DOME_COLUMNS, k / DOME_COLUMNS);
    seen[half_of] += weight * texture(dome_shadow, vec3((tile + c.xy) * vec2(1.0 / float(DOME_COLUMNS), 1.0 / float(DOME / DOME_COLUMNS)), min(c.z, 0.9999) - 0.004));
  }
  return vec2((seen[0] + 1e-4) / all[0], (seen[1] + 1e-4) / all[1]);
}

// The last few centimetres, which the dome's coarse maps miss: creases and contact.
float crease_light(vec3 p, vec3 n, float turn, float jitter, float depth) {
  const float reach = 0.07;
  float pixels = clamp(reach / (depth * 2.0 * length(ray_up) / picture.y), 2.0, 160.0);
  float hidden = 0.0;
  for (int i = 0; i < 8; ++i) {
    float r = (float(i) + jitter) / 8.0, a = float(i) * golden + turn;
    vec2 at = clamp(gl_FragCoord.xy + pixels * r * vec2(cos(a), sin(a)), vec2(0.5), picture - 0.5);
    at = floor(at) + 0.5;
    vec3 v = place_at(at, texelFetch(normal_depth, ivec2(at), 0).w) - p;
    float d2 = dot(v, v);
    float up = dot(v, n) - 0.0015 - 0.0008 * depth * length(ray_up);
    hidden += max(0.0, up * inversesqrt(d2 + 1e-6)) * max(0.0, 1.0 - d2 / (reach * reach));
  }
  return max(0.0, 1.0 - 2.2 * hidden / 8.0);
}

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 nd = texelFetch(normal_depth, pixel, 0);
  vec3 p = place_at(gl_FragCoord.xy, nd.w);
  visible = vec4(1);
  int passes = length(p - subject) > 3.0 * subject_radius + 1.0 ? 0 : 1;
  int order[16] = int[16](0, 8, 2, 10, 12, 4, 14, 6, 3, 11, 1, 9, 15, 7, 13, 5);
  int k = order[(pixel.x & 3) + 4 * (pixel.y & 3)];
  float turn = float(k) * (6.2831853 / 16.0), jitter = (float((k * 7) & 15) + 0.5) / 16.0;
  for (int pass = 0; pass < passes; ++pass) {
    vec2 dome = dome_light(p, nd.xyz, turn, jitter, (pixel.x + pixel.y) & 1);
    float crease = crease_light(p, nd.xyz, turn, jitter, nd.w);
    visible = vec4(soft_shadow(p, nd.xyz, turn, jitter), rim_light(p, nd.xyz, turn, jitter), dome * crease);
  }
})";

// One direction of a blur over 4 x 4 tiles (a tent of two) that does not cross from surface to surface.
const char* const kBlur = R"(
uniform sampler2D visible;
uniform vec2 along;
out vec4 blurred;
void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy), last = ivec2(picture) - 1, step_by = ivec2(along);
  vec4 nd = texelFetch(normal_depth, pixel, 0);
  vec3 p = place_at(gl_FragCoord.xy, nd.w);
  float slack = 1.0 / (0.004 + 0.0015 * nd.w);
  vec4 sum = vec4(0);
  float total = 0.0;
  for (int i = -3; i <= 3; ++i) {
    ivec2 q = clamp(pixel + i * step_by, ivec2(0), last);
    vec4 other = texelFetch(normal_depth, q, 0);
    float off = dot(nd.xyz, place_at(vec2(q) + 0.5, other.w) - p) * slack;
    float w = (1.0 - 0.25 * abs(float(i))) * max(1e-4, 1.0 - off * off) * smoothstep(0.3, 0.9, dot(nd.xyz, other.xyz));
    if (i == 0) w = 1.0;
    sum += w * texelFetch(visible, q, 0);
    total += w;
  }
  blurred = sum / total;
})";

// The picture in linear light. Reflectances have no 1/pi: an intensity of 1 is a light
// that makes a white surface facing it 1 bright.
const char* const kLit = R"(
centroid in vec3 place;
centroid in vec3 facing;
centroid in vec2 cloth_place;
centroid in float side;
centroid in float hem;
uniform sampler2D visible;
#if !METAL
uniform vec3 key_direction, rim_direction, key_color, rim_color, sky_color, ground_color;
uniform vec3 floor_color;
#endif
uniform vec3 outside_color, inside_color, sheen_color;
uniform float roughness, weave;
#if STONE
uniform float wetness;
#endif
uniform int two_sided;
out vec4 light;

// The visibility of this surface here. At an outline the pixel's middle may show another
// surface; then the neighbour that fits best speaks for this one.
vec4 visibility(vec3 n) {
  ivec2 pixel = ivec2(gl_FragCoord.xy), last = ivec2(picture) - 1, best = pixel;
  float best_error = 1e9;
  for (int i = 0; i < 9; ++i) {
    ivec2 q = clamp(pixel + ivec2((i + 4) % 9 % 3 - 1, (i + 4) % 9 / 3 - 1), ivec2(0), last);
    vec4 other = texelFetch(normal_depth, q, 0);
    float error = abs(dot(n, place_at(vec2(q) + 0.5, other.w) - place)) / (0.003 + 0.001 * other.w) +
                  2.0 * max(0.0, 0.9 - dot(n, other.xyz));
    if (error < best_error) { best_error = error; best = q; }
    if (i == 0 && error < 1.0) break;
  }
  return texelFetch(visible, best, 0);
}

float hash(vec2 c) {
  vec3 q = fract(vec3(c.xyx) * 0.1031);
  q += dot(q, q.yzx + 33.33);
  return fract((q.x + q.y) * q.z);
}
#if JELLY
// What jelly between here and the key light leaves of it: the mean over a disc as wide as the light is,
// seen from the jelly's far side.
uniform sampler2D jelly_tint, jelly_front;
uniform mat4 to_key;
uniform vec3 key_extent;
uniform float key_tan;
vec3 through_jelly() {
  vec3 c = (to_key * vec4(place, 1)).xyz * 0.5 + 0.5;
  vec2 per_metre = 0.5 / key_extent.xy;
  float metres = 2.0 * key_extent.z, turn = 6.2831853 * hash(gl_FragCoord.xy), most = 0.0;
  for (int i = 0; i < 6; ++i) {
    float a = float(i) * 2.399963 + turn;
    vec2 at = c.xy + 0.025 * sqrt(float(i) / 6.0) * vec2(cos(a), sin(a)) * per_metre;
    float front = texture(jelly_front, at).r;
    float gap = (c.z - front) * metres - texture(jelly_tint, at).a;
    most = max(most, front < 1.0 ? gap : 0.0);
  }
  float radius = clamp(key_tan * most, 0.003, 0.05);
  vec3 sum = vec3(0);
  for (int i = 0; i < 20; ++i) {
    float a = float(i) * 2.399963 + turn;
    vec2 at = c.xy + radius * sqrt((float(i) + 0.5) / 20.0) * vec2(cos(a), sin(a)) * per_metre;
    vec4 tint = texture(jelly_tint, at);
    bool behind = (c.z - texture(jelly_front, at).r) * metres > 0.003 && tint.a > 0.0;
    sum += behind ? 0.88 * exp(-0.8 * max(tint.rgb, vec3(0))) : vec3(1);
  }
  return sum / 20.0;
}
#else
vec3 through_jelly() { return vec3(1); }
#endif
float noise(vec2 c) {
  vec2 i = floor(c), f = fract(c);
  f = f * f * (3.0 - 2.0 * f);
  return mix(mix(hash(i), hash(i + vec2(1, 0)), f.x), mix(hash(i + vec2(0, 1)), hash(i + vec2(1, 1)), f.x), f.y);
}

// 1 where a pattern of this many periods a pixel is resolved, 0 where it would alias.
float resolved(float periods) { return 1.0 - smoothstep(0.08, 0.24, periods); }

// A plain weave: warp and weft pass over each other in turn, each a little hill.
struct Weave { vec2 tilt; float shade; };
Weave weave_at(vec2 c, float periods) {
  Weave w = Weave(vec2(0), 1.0);
  c += 0.12 * vec2(noise(c.yx * vec2(0.31, 0.05)), noise(c * vec2(0.31, 0.05)) );
  vec2 slub = c * vec2(0.021, 0.9), slub2 = c * vec2(0.9, 0.021);
  float streak = 0.5 * (noise(slub) + noise(slub2)) - 0.5;
  w.shade += 0.22 * streak * resolved(periods * 0.45);
  float blotch = noise(c * 0.06) + 0.5 * noise(c * 0.13) - 0.75;
  w.shade += 0.05 * blotch * resolved(periods * 0.1);
  float fine = resolved(periods);
  if (fine > 0.0) {
    vec2 f = fract(c) - 0.5;
    vec2 cell = floor(c);
    bool warp_on_top = mod(cell.x + cell.y, 2.0) < 0.5;
    vec2 across = warp_on_top ? vec2(f.x, 0) : vec2(0, f.y);
    vec2 length_ways = warp_on_top ? vec2(0, f.y) : vec2(f.x, 0);
    w.tilt = fine * (1.5 * across + 0.8 * length_ways);
    vec2 hill = cos(6.2831853 * vec2(across.x + across.y, length_ways.x + length_ways.y));  // 1 on the crest
    float gap = 0.86 + 0.20 * hill.x + 0.10 * hill.y - 0.10 * (1.0 - hill.x) * (1.0 - hill.y);
    w.shade *= mix(1.0, gap * (0.96 + 0.16 * hash(cell)), fine);
  }
  return w;
}

float ggx(float nh, float a) {
  float d = nh * nh * (a * a - 1.0) + 1.0;
  return a * a / (d * d);  // times pi
}
// Sheen: Estevez and Kulla's Charlie distribution with Neubelt's visibility, times pi.
float charlie(float nh, float nl, float nv, float a) {
  float s = sqrt(max(0.0, 1.0 - nh * nh));
  return (2.0 + 1.0 / a) * pow(s, 1.0 / a) * 0.5 / (4.0 * (nl + nv - nl * nv) + 1e-3);
}

struct Surface { vec3 color, sheen; float rough; };

vec3 lit_by(Surface s, vec3 n, vec3 v, vec3 l, vec3 color, float seen) {
  float nl = clamp(dot(n, l), 0.0, 1.0);
  if (nl <= 0.0) return vec3(0);
  vec3 h = normalize(l + v);
  float nh = clamp(dot(n, h), 0.0, 1.0), nv = clamp(dot(n, v), 0.02, 1.0), lh = clamp(dot(l, h), 0.0, 1.0);
  vec3 back = s.color;
#if CLOTH
  back += s.sheen * charlie(nh, nl, nv, s.rough);
#else
  float a = s.rough * s.rough, fresnel = 0.04 + 0.96 * pow(1.0 - lh, 5.0);
  float k = 0.5 * a;
  back += vec3(fresnel * ggx(nh, a) * 0.25 / ((nl * (1.0 - k) + k) * (nv * (1.0 - k) + k)));
#endif
  return back * color * nl * seen;
}

#if LAMPS
uniform int lamps;
uniform vec4 lamp_place[LAMPS];  // and how far its sparks spread, squared
uniform vec3 lamp_power[LAMPS];
vec3 lamp_light(vec3 n) {
  vec3 sum = vec3(0);
  for (int i = 0; i < lamps; ++i) {
    vec3 d = lamp_place[i].xyz - place;
    float d2 = dot(d, d), s2 = lamp_place[i].w;
    float falloff = (d2 + s2) / (d2 * d2 + s2 * (0.667 * d2 + 0.42 * s2));  // as in Lamp::falloff
    sum += lamp_power[i] * (max(0.0, dot(n, d)) * inversesqrt(d2 + 0.3 * s2) * falloff);
  }
  return sum;
}
#if STONE || METAL
vec3 lamp_gloss(vec3 n, vec3 v, float a) {
  vec3 sum = vec3(0);
  for (int i = 0; i < lamps; ++i) {
    vec3 d = lamp_place[i].xyz - place;
    float d2 = dot(d, d) + lamp_place[i].w;
    vec3 l = d * inversesqrt(d2), h = normalize(l + v);
    float wide = min(1.0, a + 0.5 * sqrt(lamp_place[i].w / d2));  // a lamp as wide as its sparks
    sum += lamp_power[i] / d2 * max(0.0, dot(n, l)) * 0.25 * ggx(clamp(dot(n, h), 0.0, 1.0), wide);
  }
  return sum;
}
#endif
#endif

#if STONE
float grain_hash(vec3 c) {
  c = fract(c * 0.1031);
  c += dot(c, c.zyx + 31.32);
  return fract((c.x + c.y) * c.z);
}
float grain(vec3 c) {
  vec3 i = floor(c), f = fract(c);
  f = f * f * (3.0 - 2.0 * f);
  return mix(mix(mix(grain_hash(i), grain_hash(i + vec3(1, 0, 0)), f.x), mix(grain_hash(i + vec3(0, 1, 0)), grain_hash(i + vec3(1, 1, 0)), f.x), f.y),
             mix(mix(grain_hash(i + vec3(0, 0, 1)), grain_hash(i + vec3(1, 0, 1)), f.x), mix(grain_hash(i + vec3(0, 1, 1)), grain_hash(i + vec3(1, 1, 1)), f.x), f.y), f.z);
}
#endif

vec3 floor_light(vec4 seen) {
  // The lamps light a pool around the subject that fades towards the background.
  float t = cloth_place.x;  // along the floor's profile
  float pool = mix(0.36, 1.0, exp(-0.42 * t * t));
  vec3 key = key_color * key_direction.y * seen.x * through_jelly();
  vec3 rim = rim_color * rim_direction.y * 0.14 * seen.y;
  return floor_color * (pool * (key + rim) + mix(0.3, 1.0, pool) * sky_color * seen.z);
}

void main() {
  vec3 n = normalize(facing), v = normalize(eye - place);
#if FLOOR
#if LAMPS
  vec4 floor_seen = visibility(n);
  light = vec4(floor_light(floor_seen) + floor_color * lamp_light(n) * mix(0.4, 1.0, floor_seen.z), 1);
#else
  light = vec4(floor_light(visibility(n)), 1);
#endif
#else
  bool back_face = two_sided == 1 && !gl_FrontFacing;
  if (back_face) n = -n;
#if STONE
  bool inside = back_face;
#else
  bool inside = back_face || side > 0.75;
#endif
  vec4 seen = visibility(n);
  Surface s = Surface(inside ? inside_color : outside_color, sheen_color * (inside ? 0.8 : 1.0), roughness);
#if CLOTH
  if (weave > 0.0) {
    vec2 dx = dFdx(cloth_place), dy = dFdy(cloth_place);
    vec2 c = cloth_place * weave;
    Weave w = weave_at(c, weave * max(length(dx), length(dy)));
    // A hem: the edge is folded over and sewn down a finger's width inside.
    float pixel = max(length(dx), length(dy)) + 1e-6;
    float stitch = exp(-pow((hem - 0.016) / max(0.0016, 0.8 * pixel), 2.0)) * min(1.0, 0.0016 / pixel);
    float fold = exp(-max(hem, 0.0) / 0.004) * min(1.0, 0.004 / pixel);
    w.shade *= 1.0 - 0.32 * stitch + 0.10 * fold;
    s.color *= w.shade;
    s.sheen *= mix(1.0, w.shade, 0.5);
    vec3 px = dFdx(place), py = dFdy(place);
    float det = dx.x * dy.y - dx.y * dy.x;
    if (abs(det) > 1e-14 && dot(w.tilt, w.tilt) > 0.0) {
      vec3 t = (px * dy.y - py * dx.y) / det, b = (py * dx.x - px * dy.x) / det;
      n = normalize(n + w.tilt.x * normalize(t - n * dot(n, t)) + w.tilt.y * normalize(b - n * dot(n, b)));
    }
  }
#endif
#if STONE
  // Layers, blotches and grains, in the place where the stone stands. What a pixel cannot
  // resolve fades to its mean.
  float footprint = 2.0 * dot(place - eye, forward) * length(ray_up) / picture.y;
  vec3 dry_n = n;
  float blotch = 0.6 * grain(place * 7.0) + 0.4 * grain(place * 19.0) - 0.5;
  float layer = grain(vec3(place.x * 2.0, place.y * 34.0 + 3.0 * blotch, place.z * 2.0)) - 0.5;
  float coarse = 1.0 - smoothstep(0.15, 0.8, 90.0 * footprint), fine = 1.0 - smoothstep(0.15, 0.8, 300.0 * footprint);
  vec3 e = vec3(0.004, 0, 0);
  float g0 = grain(place * 90.0);
  vec3 slope = vec3(grain((place + e.xyy) * 90.0), grain((place + e.yxy) * 90.0), grain((place + e.yyx) * 90.0)) - g0;
  float speck = grain(place * 300.0);
  float pit = smoothstep(0.66, 0.90, 0.6 * grain(place * 130.0 + 5.0) + 0.4 * grain(place * 47.0)) * (1.0 - smoothstep(0.15, 0.8, 130.0 * footprint));
  float wet = clamp(wetness * side, 0.0, 1.0);
  s.color *= (1.0 + 0.40 * blotch + 0.30 * layer + 0.45 * (g0 - 0.5) * coarse + 0.6 * (speck - 0.5) * fine) * (1.0 - 0.4 * pit);
  s.color = mix(s.color, s.color * vec3(1.12, 0.98, 0.84), clamp(blotch * 1.5, 0.0, 1.0));
  slope -= n * dot(slope, n);
  n = normalize(n - slope * (0.55 * coarse * (1.0 - 0.7 * wet)));
  s.color *= mix(1.0, 0.50, wet);
  s.rough = mix(s.rough, 0.16, wet);
#endif
  float nv = clamp(dot(n, v), 0.0, 1.0);
#if METAL
  // Brushed around the vertical: fine scratches spread what it mirrors across them.
  vec3 scratch = cross(n, abs(n.y) < 0.97 ? vec3(0, 1, 0) : vec3(1, 0, 0));
  scratch = normalize(scratch);
  vec3 across = cross(n, scratch);
  float footprint = 2.0 * dot(place - eye, forward) * length(ray_up) / picture.y;
  vec2 c = vec2(dot(place, across), dot(place, scratch));
  float line = (noise(c * vec2(900, 14)) - 0.5) * (1.0 - smoothstep(0.15, 0.8, 900.0 * footprint)) +
               (noise(c * vec2(240, 5)) - 0.5) * (1.0 - smoothstep(0.15, 0.8, 240.0 * footprint));
  n = normalize(n + across * 0.10 * line);
  vec3 mirror = vec3(0);
  for (int i = -3; i <= 3; ++i) {
    vec3 m = normalize(n + across * (0.16 * s.rough * float(i)));
    mirror += (4.0 - abs(float(i))) / 16.0 * mirrored(reflect(-v, m), 0.10 + 0.5 * s.rough);
  }
  vec3 shine = s.color + (1.0 - s.color) * pow(1.0 - nv, 5.0);
  vec3 result = shine * mirror * mix(0.35, 1.0, 0.5 * (seen.x + seen.z)) * (1.0 + 0.30 * line);
#if LAMPS
  result += shine * (2.0 * lamp_gloss(n, v, 0.5 * s.rough + 0.08) + 0.15 * lamp_light(n));
#endif
  light = vec4(result, 1);
#else
  vec3 result = lit_by(s, n, v, key_direction, key_color * through_jelly(), seen.x) + lit_by(s, n, v, rim_direction, rim_color, seen.y);
  float up = 0.5 + 0.5 * n.y;
  vec3 around = sky_color * up * seen.z + ground_color * floor_color * (1.0 - up) * seen.w;
  result += s.color * around;
#if CLOTH
  result += s.sheen * around * 0.9 * pow(1.0 - nv, 3.0);
#else
  result += around * 0.5 * (0.04 + 0.5 * pow(1.0 - nv, 5.0) * (1.0 - s.rough * 0.6));
#endif
#if STONE
  // A film of water mirrors the light from above.
  float film = wet * (0.02 + 0.98 * pow(1.0 - clamp(dot(dry_n, v), 0.0, 1.0), 5.0));
  result = mix(result, around * 1.3 / max(up, 0.3), film * 0.8);
#endif
#if LAMPS
  result += s.color * lamp_light(n) * mix(0.5, 1.0, seen.z);
#if STONE
  result += 0.04 * lamp_gloss(n, v, s.rough * s.rough);
#endif
#endif
  light = vec4(result, 1);
#endif
#endif
})";

// Tone curve: Hill's fit of the ACES reference and output transforms. It is applied to
// every sample before they are averaged, or bright edges would alias.
const char* const kDevelop = R"(
uniform sampler2DMS picture_light;
uniform int supersample, samples;
uniform float exposure;
#if VEIL
uniform sampler2D veil;
#endif
#if GLOW
uniform sampler2D glow, bloom;
uniform float bloom_share;
#endif
out vec4 finished;
vec3 film(vec3 c) {
  c = mat3(0.59719, 0.07600, 0.02840, 0.35458, 0.90834, 0.13383, 0.04823, 0.01566, 0.83777) * c;
  c = (c * (c + 0.0245786) - 0.000090537) / (c * (0.983729 * c + 0.4329510) + 0.238081);
  return mat3(1.60475, -0.10208, -0.00327, -0.53108, 1.10813, -0.07276, -0.07367, -0.00605, 1.07602) * c;
}
float hash(vec2 c) {
  vec3 q = fract(vec3(c.xyx) * 0.1031);
  q += dot(q, q.yzx + 33.33);
  return fract((q.x + q.y) * q.z);
}
void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec2 at = gl_FragCoord.xy * float(supersample) / vec2(textureSize(picture_light)) * 2.0 - 1.0;
  float vignette = 1.0 - 0.20 * smoothstep(0.35, 2.1, dot(at, at));
  vec3 sum = vec3(0);
#if VEIL || GLOW
  for (int y = 0; y < supersample; ++y)
    for (int x = 0; x < supersample; ++x) {
      ivec2 at_sample = pixel * supersample + ivec2(x, y);
      vec4 over = vec4(0, 0, 0, 1);
#if VEIL
      over = texelFetch(veil, at_sample, 0);
#endif
#if GLOW
      vec2 share = (vec2(at_sample) + 0.5) / vec2(textureSize(picture_light));
      over.rgb += (1.0 - bloom_share) * texelFetch(glow, at_sample, 0).rgb + texture(bloom, share).rgb;
#endif
      for (int s = 0; s < samples; ++s) {
        vec3 light = texelFetch(picture_light, at_sample, s).rgb * over.a + over.rgb;
        sum += clamp(film(exposure * vignette * min(light, 1e4)), 0.0, 1.0);
      }
    }
#else
  for (int y = 0; y < supersample; ++y)
    for (int x = 0; x < supersample; ++x)
      for (int s = 0; s < samples; ++s)
        sum += clamp(film(exposure * vignette * texelFetch(picture_light, pixel * supersample + ivec2(x, y), s).rgb), 0.0, 1.0);
#endif
  vec3 c = 0.006 + 0.986 * sum / float(supersample * supersample * samples);
  c = mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
  float dither = hash(gl_FragCoord.xy) + hash(gl_FragCoord.xy + 71.7) - 1.0;
  finished = vec4(c + dither / 255.0, 1);
})";

std::string dome_size() {
  return "#define DOME " + std::to_string(kDomeDirections) + "\n#define DOME_UP " + std::to_string(kDomeUpward) +
         "\n#define DOME_COLUMNS " + std::to_string(kDomeColumns) + "\n";
}

}  // namespace

std::string depth_vertex_shader() { return std::string(kVersion) + kDepthVertex; }
std::string depth_fragment_shader() { return std::string(kVersion) + "void main() {}"; }
std::string surface_vertex_shader() { return std::string(kVersion) + kSurfaceVertex; }
std::string floor_vertex_shader() { return std::string(kVersion) + kFloorVertex; }
std::string prepass_fragment_shader() { return std::string(kVersion) + kPrepass; }
std::string full_screen_vertex_shader() { return std::string(kVersion) + kFullScreenVertex; }
std::string visibility_fragment_shader() { return kVersion + dome_size() + kPlaceOfPixel + kVisibility; }
std::string blur_fragment_shader() { return std::string(kVersion) + kPlaceOfPixel + kBlur; }
std::string lit_fragment_shader(Shade shade, bool lamps, bool jelly) {
  std::string choice;
  for (const auto& [name, which] :
       {std::pair{"FLOOR", Shade::Floor}, {"CLOTH", Shade::Cloth}, {"STONE", Shade::Stone}, {"METAL", Shade::Metal}})
    choice += std::string("#define ") + name + (shade == which ? " 1\n" : " 0\n");
  choice += std::string("#define JELLY ") + (jelly ? "1\n" : "0\n");
  choice += "#define LAMPS " + std::to_string(lamps ? kMostLamps : 0) + "\n";
  if (shade == Shade::Metal) return kVersion + choice + kPlaceOfPixel + studio_functions() + kLit;
  return kVersion + choice + kPlaceOfPixel + kLit;
}
std::string develop_fragment_shader(bool veil, bool glow) {
  return kVersion + std::string("#define VEIL ") + (veil ? "1" : "0") + "\n#define GLOW " + (glow ? "1" : "0") + "\n" +
         kDevelop;
}
std::string place_of_pixel() { return kPlaceOfPixel; }

}  // namespace hooke::render

#include <render/shaders.hpp>

namespace hooke::render {

namespace {

const char* const kVersion = "#version 330 core\n";

// What a smooth thing mirrors of the studio: its wall, the light from above, the floor,
// and the two lamps, `spread` wider [rad] for rough things.
const char* const kStudio = R"(
uniform vec3 key_direction, rim_direction, key_color, rim_color, sky_color, ground_color, floor_color;
uniform float key_size;
vec3 lamp_disc(vec3 d, vec3 towards, vec3 color, float half_angle) {
  float c = dot(d, towards), edge = cos(half_angle);
  float soft = 0.35 * (1.0 - edge);
  return color * smoothstep(edge - soft, edge + soft, c) / (1.0 - cos(half_angle)) * 0.5;
}
vec3 mirrored(vec3 d, float spread) {
  vec3 lit_floor = floor_color * (key_color * key_direction.y + sky_color);
  vec3 wall = floor_color * (0.36 * key_color * key_direction.y + 0.55 * sky_color);
  vec3 above = mix(wall, 1.35 * sky_color, smoothstep(0.05, 0.75, d.y));
  vec3 around = mix(lit_floor, above, smoothstep(-0.25 - spread, 0.02 + spread, d.y));
  float half_angle = 0.5 * key_size + 0.03 + spread;
  return around + lamp_disc(d, key_direction, key_color, half_angle) + lamp_disc(d, rim_direction, rim_color, 0.16 + spread);
}
)";

// A streak is all points within `thickness` of the way from head to tail, in the picture.
// Its light is that of the ball it stands for, seen for the time the shutter was open:
// radiance times the ball's area in the picture, however thick and long it is drawn.
const char* const kStreakVertex = R"(
layout(location = 0) in vec4 head_radius;
layout(location = 1) in vec3 tail;
layout(location = 2) in vec3 radiance;
uniform mat4 to_clip;
uniform vec3 eye, forward, ray_up;
uniform vec2 picture;
uniform float near, least_thickness;
flat out vec4 way;        // head and tail [pixels]
flat out vec2 nearness;   // 1 / depth of head and tail
flat out vec3 light_peak;
flat out vec2 thickness_slack;
flat out float fade;      // light at the tail, as a share of the head's
void main() {
  vec3 h = head_radius.xyz, t = tail;
  float hd = dot(h - eye, forward), td = dot(t - eye, forward);
  float kept = 1.0;
  gl_Position = vec4(2, 2, 2, 1);
  if (max(hd, td) > near) {
    if (hd < near) { float s = (near - td) / (hd - td); h = mix(t, h, s); hd = near; kept = s; }
    if (td < near) { float s = (near - hd) / (td - hd); t = mix(h, t, s); td = near; kept = s; }
    vec4 hc = to_clip * vec4(h, 1), tc = to_clip * vec4(t, 1);
    vec2 a = (hc.xy / hc.w * 0.5 + 0.5) * picture, b = (tc.xy / tc.w * 0.5 + 0.5) * picture;
    float depth = 2.0 / (1.0 / hd + 1.0 / td);
    float radius = head_radius.w * 0.5 * picture.y / (depth * length(ray_up));
    float thick = min(max(1.25 * radius, least_thickness), picture.y);
    vec2 along = a - b;
    float reach = length(along);
    along = reach > 1e-4 ? along / reach : vec2(1, 0);
    vec2 across = vec2(-along.y, along.x);
    fade = 1.0 - 0.88 * reach / (reach + 2.0 * thick);
    // The integrals of the light over the straight part and the two round ends.
    float whole = reach * thick * 16.0 / 15.0 * (fade + (1.0 - fade) / 3.0) + 0.5235988 * thick * thick * (1.0 + fade);
    light_peak = radiance * kept * 3.1415927 * radius * radius / whole;
    way = vec4(a, b);
    nearness = 1.0 / vec2(hd, td);
    thickness_slack = vec2(thick, head_radius.w);
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
    vec2 at = mix(b, a, corner.x) + (2.0 * corner.x - 1.0) * along * (thick + 0.5) + (2.0 * corner.y - 1.0) * across * (thick + 0.5);
    gl_Position = vec4(at / picture * 2.0 - 1.0, 0, 1);
  }
})";

const char* const kStreak = R"(
flat in vec4 way;
flat in vec2 nearness;
flat in vec3 light_peak;
flat in vec2 thickness_slack;
flat in float fade;
out vec4 light;
void main() {
  vec2 to_tail = way.zw - way.xy, from_head = gl_FragCoord.xy - way.xy;
  float t = clamp(dot(from_head, to_tail) / max(dot(to_tail, to_tail), 1e-6), 0.0, 1.0);
  vec2 off = (from_head - t * to_tail) / thickness_slack.x;
  float inside = max(0.0, 1.0 - dot(off, off));
  float depth = 1.0 / mix(nearness.x, nearness.y, t);
  float slack = thickness_slack.y + 0.002 * depth;
  float seen = clamp(1.0 + (texelFetch(normal_depth, ivec2(gl_FragCoord.xy), 0).w - depth) / slack, 0.0, 1.0);
  light = vec4(light_peak * (fade + (1.0 - fade) * (1.0 - t) * (1.0 - t)) * inside * inside * seen, 1);
})";

const char* const kSpriteVertex = R"(
layout(location = 0) in vec4 place_radius;
layout(location = 1) in vec4 color_opacity;
layout(location = 2) in vec4 way_turn;     // drops: from tail to head [m]
layout(location = 3) in vec4 lamp_shade;   // light of the sparks; how much of the key light gets here
uniform mat4 to_clip;
uniform vec3 eye, forward, ray_right, ray_up;
uniform vec2 picture;
uniform float near, least_radius;
uniform int puffs, patterns;
flat out vec3 middle;
flat out vec4 color;
flat out vec4 lamp;
flat out vec4 shape;   // depth, radius [m], half length and half width [pixels]
flat out vec4 axes;    // drops: the long axis in the picture; puffs: cosine and sine of the turn, pattern
out vec2 local;        // 1 at the rim
void main() {
  middle = place_radius.xyz;
  float depth = dot(middle - eye, forward), radius = place_radius.w;
  gl_Position = vec4(2, 2, 2, 1);
  if (depth > near) {
    vec4 clip = to_clip * vec4(middle, 1);
    vec2 at = (clip.xy / clip.w * 0.5 + 0.5) * picture;
    float pixels = 0.5 * picture.y / (depth * length(ray_up));
    vec2 along = vec2(dot(way_turn.xyz, ray_right) / length(ray_right), dot(way_turn.xyz, ray_up) / length(ray_up));
    float half_way = 0.5 * length(along) * pixels, real = radius * pixels;
    along = half_way > 1e-4 ? normalize(along) : vec2(1, 0);
    float wide = max(real, least_radius), longer = wide + half_way;
    color = color_opacity;
    // What is drawn larger or smeared along its way hides less.
    color.a *= (real / wide) * (real / wide) * (half_way > 0.0 ? min(1.0, 1.25 * wide / longer) : 1.0);
    lamp = lamp_shade;
    shape = vec4(depth, radius, longer, wide);
    // A puff is turned, by an angle that also picks one of its patterns; a drop is drawn out.
    axes = vec4(along, 0.0, 0.0);
    if (puffs == 1) {
      axes = vec4(cos(way_turn.w), sin(way_turn.w), 0.0, floor(fract(way_turn.w * 0.8270) * float(patterns)));
      color.a *= clamp((depth - near) / radius, 0.0, 1.0);
    }
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
    vec2 size = vec2(longer, wide) + 1.0;
    local = corner * size / (size - 1.0);
    vec2 offset = corner.x * size.x * along + corner.y * size.y * vec2(-along.y, along.x);
    gl_Position = vec4((at + offset) / picture * 2.0 - 1.0, 0, 1);
  }
})";

// A puff is a ball of haze (spherical billboards, Umenhoffer, Szirmay-Kalos and Szijarto
// 2006): where a surface cuts it, what is left in front is thinner.
const char* const kPuff = R"(
flat in vec3 middle;
flat in vec4 color;
flat in vec4 lamp;
flat in vec4 shape;
flat in vec4 axes;
in vec2 local;
uniform sampler2D puff_map;
uniform int patterns, pictured;
uniform float near;
uniform vec3 key_direction, rim_direction, above;  // in the picture's basis: right, up, towards the eye
uniform vec3 key_color, rim_color, sky_color, ground_color, floor_color;
out vec4 veil;
void main() {
  vec2 turn = axes.xy;  // cosine and sine
  vec2 turned = vec2(turn.x * local.x - turn.y * local.y, turn.y * local.x + turn.x * local.y);
  vec2 at = clamp(turned * 0.5 + 0.5, 0.004, 0.996);
  vec4 puff = textureLod(puff_map, vec2((at.x + axes.w) / float(patterns), at.y), 0.0);
  float bulge = sqrt(max(0.0, 1.0 - dot(local, local))), half_depth = shape.y * max(bulge, 0.02);
  float behind = texelFetch(normal_depth, ivec2(gl_FragCoord.xy), 0).w;
  float in_front = clamp((behind - shape.x + half_depth) / (2.0 * half_depth), 0.0, 1.0);
  in_front *= max(abs(turned.x), abs(turned.y)) < 1.0 ? 1.0 : 0.0;
  float hides = color.a * puff.a * in_front;
  vec2 lean = puff.rg * 2.0 - 1.0;
  lean = pictured == 1 ? vec2(0) : vec2(turn.x * lean.x + turn.y * lean.y, turn.x * lean.y - turn.y * lean.x);
  vec3 n = normalize(vec3(0.75 * local + lean, 0.35 + 0.65 * bulge));
  float key = max(0.0, (dot(n, key_direction) + 0.7) / 1.7), rim = max(0.0, (dot(n, rim_direction) + 0.8) / 1.8);
  float up = 0.5 + 0.5 * dot(n, above);
  vec3 lit = key_color * (key * key * lamp.w) + rim_color * (0.45 * rim * rim) + sky_color * (up * (0.45 + 0.55 * lamp.w)) +
             ground_color * floor_color * (1.0 - up) + lamp.rgb;
  veil = vec4(color.rgb * (pictured == 1 ? puff.rgb : vec3(1)) * lit * hides, hides);
})";

// A drop is a ball of water: light that goes through is bent going in and coming out, so
// it shows nearly all that is behind it, upside down, and at its rim mirrors the studio.
const char* const kDrop = R"(
flat in vec3 middle;
flat in vec4 color;
flat in vec4 lamp;
flat in vec4 shape;
flat in vec4 axes;
in vec2 local;
uniform sampler2D scene;
uniform mat4 to_clip;
out vec4 veil;
// The light that comes to the eye from the place `lean` (right, up; 1 at the rim) of the ball.
vec3 light_at(vec2 lean, vec3 v, float spread) {
  float bulge = sqrt(max(0.0, 1.0 - dot(lean, lean)));
  vec3 n = normalize(lean.x * normalize(ray_right) + lean.y * normalize(ray_up) + bulge * v);
  float nv = clamp(dot(n, v), 0.02, 1.0), fresnel = 0.02 + 0.98 * pow(1.0 - nv, 5.0);
  vec3 within = refract(-v, n, 0.75), out_n = n - 2.0 * dot(n, within) * within;
  vec3 beyond = refract(within, -out_n, 1.333);
  if (dot(beyond, beyond) < 0.5) beyond = within;
  // What lies that way: the picture where it shows it, else the studio.
  vec4 clip = to_clip * vec4(middle + 1.2 * beyond, 1);
  vec2 at = clip.xy / max(clip.w, 1e-3) * 0.5 + 0.5, within_picture = min(at, 1.0 - at);
  float shown = clip.w > 0.05 ? clamp(20.0 * min(within_picture.x, within_picture.y), 0.0, 1.0) : 0.0;
  vec3 through = mix(mirrored(beyond, spread), texture(scene, clamp(at, 0.0, 1.0)).rgb, shown);
  vec3 light = mix(through * color.rgb * (1.0 - 0.35 * pow(1.0 - nv, 2.0)), mirrored(reflect(-v, n), spread), fresnel);
  return min(light, 40.0);
}
void main() {
  float rim = length(local);
  vec2 inside = local * min(1.0, 0.985 / max(rim, 1e-4));
  float depth = shape.x - sqrt(max(0.0, 1.0 - dot(inside, inside))) * shape.y;
  vec3 v = normalize(eye - middle), light = vec3(0);
  // Where a drop flew by, each place saw the whole width of it.
  float smear = 1.0 - smoothstep(0.3, 0.7, shape.w / shape.z), half_width = sqrt(max(0.0, 0.97 - inside.y * inside.y));
  int moments = smear > 0.0 ? 5 : 1;
  for (int i = 0; i < moments; ++i) {
    float moment = (2.0 * float(i) + 1.0) / float(moments) - 1.0;
    vec2 lean = vec2(mix(inside.x, moment * half_width, smear), inside.y);
    light += light_at(lean.x * axes.xy + lean.y * vec2(-axes.y, axes.x), v, 0.05 + 0.18 * smear);
  }
  light = light / float(moments) + lamp.rgb * 0.15;
  float seen = clamp(1.0 + (texelFetch(normal_depth, ivec2(gl_FragCoord.xy), 0).w - depth) / (0.25 * shape.y + 0.001 * depth), 0.0, 1.0);
  float hides = color.a * clamp((1.0 - rim) * shape.w + 0.5, 0.0, 1.0) * seen;
  veil = vec4(light * hides, hides);
})";

// Down by half: five overlapping boxes (Jimenez, "Next Generation Post Processing in Call
// of Duty", SIGGRAPH 2014), so that thin bright things do not flicker.
const char* const kNarrow = R"(
uniform sampler2D source;
uniform vec2 size;  // of the target
out vec4 spread;
void main() {
  vec2 at = gl_FragCoord.xy / size, d = 1.0 / vec2(textureSize(source, 0));
  vec3 sum = vec3(0);
  for (int y = -2; y <= 2; ++y)
    for (int x = -2; x <= 2; ++x) {
      bool odd = (x & 1) == 1 || (y & 1) == 1;
      if (odd && ((x & 1) != 1 || (y & 1) != 1)) continue;
      float weight = odd ? 0.125 : 0.03125 * (x == 0 ? 2.0 : 1.0) * (y == 0 ? 2.0 : 1.0);
      sum += weight * texture(source, at + d * vec2(x, y)).rgb;
    }
  spread = vec4(sum, 1);
})";

const char* const kWiden = R"(
uniform sampler2D source;
uniform vec2 size;
uniform float share;
out vec4 spread;
void main() {
  vec2 at = gl_FragCoord.xy / size, d = 1.0 / vec2(textureSize(source, 0));
  vec3 sum = vec3(0);
  for (int y = -1; y <= 1; ++y)
    for (int x = -1; x <= 1; ++x)
      sum += (x == 0 ? 2.0 : 1.0) * (y == 0 ? 2.0 : 1.0) / 16.0 * texture(source, at + d * vec2(x, y)).rgb;
  spread = vec4(share * sum, 1);
})";

// The mean of a pixel's samples, for what bends the light of the picture behind it.
const char* const kResolve = R"(
uniform sampler2DMS picture_light;
uniform int samples;
out vec4 light;
void main() {
  vec3 sum = vec3(0);
  for (int s = 0; s < samples; ++s) sum += min(texelFetch(picture_light, ivec2(gl_FragCoord.xy), s).rgb, 50.0);
  light = vec4(sum / float(samples), 1);
})";

const char* const kWater = R"(
centroid in vec3 place;
centroid in vec3 facing;
centroid in vec2 cloth_place;
centroid in float side;
centroid in float hem;
uniform sampler2D scene;
uniform mat4 to_clip;
uniform vec3 outside_color;
uniform float roughness;
uniform int stream;
out vec4 light;

float hash(vec3 c) {
  c = fract(c * 0.1031);
  c += dot(c, c.zyx + 31.32);
  return fract((c.x + c.y) * c.z);
}
float noise(vec3 c) {
  vec3 i = floor(c), f = fract(c);
  f = f * f * (3.0 - 2.0 * f);
  return mix(mix(mix(hash(i), hash(i + vec3(1, 0, 0)), f.x), mix(hash(i + vec3(0, 1, 0)), hash(i + vec3(1, 1, 0)), f.x), f.y),
             mix(mix(hash(i + vec3(0, 0, 1)), hash(i + vec3(1, 0, 1)), f.x), mix(hash(i + vec3(0, 1, 1)), hash(i + vec3(1, 1, 1)), f.x), f.y), f.z);
}
// 0 in the middle of a cell of bubbles, 1 on the walls between (Worley's noise).
float bubbles(vec2 c) {
  vec2 i = floor(c), f = c - i;
  float first = 9.0, second = 9.0;
  for (int y = -1; y <= 1; ++y)
    for (int x = -1; x <= 1; ++x) {
      vec2 o = vec2(x, y);
      vec2 d = o + 0.9 * vec2(hash(vec3(i + o, 1.0)), hash(vec3(i + o, 9.0))) - f;
      float d2 = dot(d, d);
      second = min(second, max(first, d2));
      first = min(first, d2);
    }
  return 1.0 - smoothstep(0.0, 0.45, sqrt(second) - sqrt(first));
}
vec4 behind(vec2 pixel) { return texelFetch(normal_depth, ivec2(clamp(pixel, vec2(0.5), picture - 0.5)), 0); }
vec2 pixel_of(vec3 p) {
  vec4 c = to_clip * vec4(p, 1);
  return clamp((c.xy / max(c.w, 1e-4) * 0.5 + 0.5) * picture, vec2(0.5), picture - 0.5);
}

void main() {
  vec3 n = normalize(facing), v = normalize(eye - place);
  if (dot(n, v) < 0.0) n = -n;
  float nv = clamp(dot(n, v), 0.03, 1.0), fresnel = 0.02 + 0.98 * pow(1.0 - nv, 5.0);
  float depth = dot(place - eye, forward), slant = max(0.05, -dot(v, forward));

  // Through: ripples bend what is behind. How much nearer flat water makes its ground look
  // is left out, since the picture does not have what that would uncover.
  float deep = clamp((behind(gl_FragCoord.xy).w - depth) / slant, 0.0, 1.0);
  vec3 calm = normalize(mix(v, vec3(0, 1, 0), smoothstep(0.5, 0.85, n.y)));
  vec2 shift = pixel_of(place + refract(-v, n, 0.75) * deep) - pixel_of(place + refract(-v, calm, 0.75) * deep);
  float most = 0.07 * picture.y;
  shift *= most / (most + length(shift));
  vec2 at = clamp(gl_FragCoord.xy + shift, vec2(0.5), picture - 0.5);
  float there = behind(at).w;
  if (there < depth) { at = gl_FragCoord.xy; there = behind(at).w; }
  float way = clamp((there - depth) / slant, 0.0, 3.0);
  vec3 left = pow(max(outside_color, vec3(0.01)), vec3(way / 0.1));
  vec3 through = texture(scene, at / picture).rgb * left + outside_color * (1.0 - left) * 0.08 * (sky_color + 0.5 * key_color);

  // A stream is round: its far side bends the light once more, as a drop's does.
  if (stream == 1) {
    vec3 within = refract(-v, n, 0.75), far_n = n - 2.0 * dot(n, within) * within;
    vec3 beyond = refract(within, -far_n, 1.333);
    if (dot(beyond, beyond) < 0.5) beyond = within;
    vec4 clip = to_clip * vec4(place + 1.2 * beyond, 1);
    vec2 q = clip.xy / max(clip.w, 1e-3) * 0.5 + 0.5, margin = min(q, 1.0 - q);
    float shown = clip.w > 0.05 ? clamp(20.0 * min(margin.x, margin.y), 0.0, 1.0) : 0.0;
    through = mix(mirrored(beyond, 0.3), texture(scene, clamp(q, 0.0, 1.0)).rgb, 0.5 * shown);
    through = min(through, 10.0) * outside_color;
  }

  // Mirrored: what of the solid picture the ray meets, else the studio.
  vec3 r = reflect(-v, n);
  vec3 mirror = mirrored(r, stream == 1 ? 0.12 : 0.5 * roughness);
  float stride = 0.03;
  int steps = r.y > -0.2 ? 14 : 0;
  float found = 0.0;
  vec3 p = place + n * 0.004, met = vec3(0);
  for (int i = 0; i < steps; ++i) {
    p += r * stride;
    stride *= 1.22;
    vec2 q = pixel_of(p);
    float gap = dot(p - eye, forward) - behind(q).w;
    if (gap > 0.0 && gap < 0.08 + 2.0 * stride) {
      met = texture(scene, q / picture).rgb;
      vec2 rim = min(q, picture - q) / (0.06 * picture);
      found = clamp(min(rim.x, rim.y), 0.0, 1.0);
      break;
    }
  }
  mirror = mix(mirror, met, found);
  vec3 result = mix(through, mirror, fresnel);
  float wrap = clamp((dot(n, key_direction) + 0.3) / 1.3, 0.0, 1.0);
  // Air that a stream takes along scatters light.
  if (stream == 1) {
    float behind_light = pow(clamp(dot(-v, rim_direction), 0.0, 1.0), 3.0);
    float side_light = clamp((dot(n, rim_direction) + 0.4) / 1.4, 0.0, 1.0);
    result = mix(result, 0.8 * (key_color * wrap + rim_color * (0.5 * side_light + behind_light) + sky_color), 0.28);
  }

  // Foam: a lace of bubbles, closed where there is much.
  float lace = 0.0;
  if (side > 0.01) {
    vec2 ground = place.xz + 0.7 * place.y;
    ground += 0.012 * vec2(noise(place * 45.0), noise(place.zxy * 45.0 + 7.0));
    lace = 0.6 * bubbles(ground * 42.0) + 0.4 * bubbles(ground * 115.0 + 3.7);
  }
  float thin = 1.0 - side;
  float foam = smoothstep(thin - 0.12, thin + 0.30, lace + 0.25 * side) * smoothstep(0.0, 0.15, side);
  vec3 white = vec3(0.72, 0.76, 0.78) * (0.62 + 0.45 * lace) * (key_color * wrap * 0.8 + sky_color);
  light = vec4(mix(result, white, 0.88 * foam), 1);
})";

// Seen from the key light: the way through all jelly [m], and times what a metre of it absorbs. Back faces add
// their depth, front faces take theirs off.
const char* const kTint = R"(
uniform float metres;
uniform vec3 absorbed;
out vec4 tint;
void main() {
  float z = (gl_FrontFacing ? -1.0 : 1.0) * gl_FragCoord.z * metres;
  tint = vec4(absorbed * z, z);
})";

// Light bends where it enters, passes to the far side, and leaves it or is mirrored there. On the way it is
// absorbed, and a little of what comes from the lights is scattered into it, which makes the jelly glow.
const char* const kJelly = R"(
centroid in vec3 place;
centroid in vec3 facing;
centroid in vec2 cloth_place;
centroid in float side;
centroid in float hem;
uniform sampler2D scene, solid, back, visible, jelly_front;
uniform mat4 to_clip, to_key;
uniform vec3 absorbed, key_extent;
uniform float roughness;
out vec4 light;

const float bend = 1.36, cloud = 9.0;  // of refraction; scattered, a metre

vec2 pixel_of(vec3 p) {
  vec4 c = to_clip * vec4(p, 1);
  return clamp((c.xy / max(c.w, 1e-4) * 0.5 + 0.5) * picture, vec2(0.5), picture - 0.5);
}
float entry(vec3 p) {  // way of the key light through the jelly to here
  vec3 c = (to_key * vec4(p, 1)).xyz * 0.5 + 0.5;
  float front = texture(jelly_front, c.xy).r;
  return front < 1.0 ? clamp((c.z - front) * 2.0 * key_extent.z, 0.0, 0.4) : 0.0;
}

void main() {
  vec3 n = normalize(facing), v = normalize(eye - place);
  float nv = clamp(dot(n, v), 0.02, 1.0), fresnel = 0.024 + 0.976 * pow(1.0 - nv, 5.0);
  vec4 seen = texelFetch(visible, ivec2(gl_FragCoord.xy), 0);
  vec3 within = refract(-v, n, 1.0 / bend);

  // The far side, found in three steps along planes.
  vec4 far = texelFetch(back, ivec2(gl_FragCoord.xy), 0);
  float way = far.w > 0.0 ? clamp((far.w - dot(place - eye, forward)) / max(0.1, dot(within, forward)), 0.001, 0.5) : 0.004;
  vec3 far_n = far.w > 0.0 ? far.xyz : n;
  for (int i = 0; i < 3; ++i) {
    vec2 q = floor(pixel_of(place + way * within)) + 0.5;
    far = texelFetch(back, ivec2(q), 0);
    float along = dot(within, far.xyz);
    if (far.w > 0.0 && along > 0.05) {
      way = clamp(dot(place_at(q, far.w) - place, far.xyz) / along, 0.001, 0.5);
      far_n = far.xyz;
    } else {
      way *= 0.75;
    }
  }
  vec3 leaves = place + way * within;
  vec3 beyond = refract(within, -far_n, bend);
  bool mirrors = dot(beyond, beyond) < 0.5;
  vec3 lost = absorbed + 0.5 * cloud;

  vec3 behind;
  float total = way;
  if (mirrors) {
    vec3 next = reflect(within, far_n);
    total += 0.6 * way;
    behind = 0.75 * mirrored(next, 0.5) * mix(0.4, 1.0, seen.z);
  } else {
    float there = texture(solid, pixel_of(leaves) / picture).w;
    float gap = clamp((there - dot(leaves - eye, forward)) / max(0.15, dot(beyond, forward)), 0.0, 0.6);
    vec2 at = pixel_of(leaves + gap * beyond);
    if (texelFetch(solid, ivec2(at), 0).w < dot(place - eye, forward)) at = gl_FragCoord.xy;
    vec2 spread = vec2(0.0015 + 0.02 * way) * picture.y;
    behind = vec3(0);
    for (int i = 0; i < 8; ++i) {
      float a = float(i) * 2.399963;
      behind += texture(scene, clamp((at + spread * sqrt((float(i) + 0.3) / 8.0) * vec2(cos(a), sin(a))) / picture, vec2(0), vec2(1))).rgb / 8.0;
    }
    // What meets the far side at a grazing angle is partly mirrored.
    float out_nv = clamp(dot(beyond, far_n), 0.0, 1.0);
    behind = mix(behind, 0.5 * mirrored(reflect(within, far_n), 0.5), 0.02 + 0.7 * pow(1.0 - out_nv, 4.0));
  }

  vec3 glow = vec3(0);
  vec3 sky = sky_color * mix(0.35, 1.0, seen.z), ground = ground_color * floor_color * seen.w;
  for (int i = 0; i < 8; ++i) {
    float s = (float(i) + 0.5) / 8.0 * total;
    vec3 p = place + min(s, way) * within;
    vec3 here = key_color * mix(0.15, 1.0, seen.x) * exp(-absorbed * entry(p)) + rim_color * 0.25 * exp(-absorbed * 0.04);
    here += (1.3 * sky + ground) * exp(-absorbed * 0.02);
    glow += here * exp(-lost * s);
  }
  glow *= cloud * 0.30 * total / 8.0;

  vec3 mirror = mirrored(reflect(-v, n), roughness);
  // The skin: light scattered near the surface, which shows its form.
  float wrap = max(0.0, (dot(n, key_direction) + 0.35) / 1.35);
  vec3 skin = exp(-absorbed * 0.022) * (key_color * wrap * wrap * seen.x + sky * (0.5 + 0.5 * n.y) + 0.2 * rim_color * max(0.0, dot(n, rim_direction)));
  light = vec4(fresnel * mirror * mix(0.4, 1.0, seen.z) + (1.0 - fresnel) * (behind * exp(-lost * total) + glow + 0.10 * skin), 1);
})";

}  // namespace

std::string studio_functions() { return kStudio; }
std::string streak_vertex_shader() { return std::string(kVersion) + kStreakVertex; }
std::string streak_fragment_shader() { return kVersion + place_of_pixel() + kStreak; }
std::string sprite_vertex_shader() { return std::string(kVersion) + kSpriteVertex; }
std::string puff_fragment_shader() { return kVersion + place_of_pixel() + kPuff; }
std::string drop_fragment_shader() { return kVersion + place_of_pixel() + kStudio + kDrop; }
std::string narrow_fragment_shader() { return std::string(kVersion) + kNarrow; }
std::string widen_fragment_shader() { return std::string(kVersion) + kWiden; }
std::string resolve_fragment_shader() { return std::string(kVersion) + kResolve; }
std::string tint_fragment_shader() { return std::string(kVersion) + kTint; }
std::string jelly_fragment_shader() { return kVersion + place_of_pixel() + kStudio + kJelly; }
std::string water_fragment_shader() { return kVersion + place_of_pixel() + kStudio + kWater; }

}  // namespace hooke::render

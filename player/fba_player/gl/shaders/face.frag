#version 330 core
//include lighting.glsl
#ifdef FINELY
centroid in vec3 before;
#ifdef SMOOTH
centroid in vec3 keyed;
#endif
#endif
uniform sampler2D picture; // square roots of linear light
uniform sampler2D relief;  // noise of three channels
uniform vec2 fine;         // strength of the skin's relief, 0 for none, and its repetitions
uniform float scatter;     // how much light scatters below the surface: 1 skin, 0 cloth
uniform float two_sided;   // 0: the inside is drawn as a dark hollow
#if defined(CUT) || defined(VEIL)
uniform float opacity;
#endif
#ifdef CUT
uniform float cut;         // pixels that are less opaque are holes
#endif
#ifdef WRINKLED
uniform sampler2D wrinkle_map;
uniform vec4 wrinkle_window; // of a place: factors and offsets to the map's coordinates
const vec3 DARKENS = vec3(0.50, 0.58, 0.60); // light in a groove comes through the skin, and is redder
centroid in vec2 wrinkle_place;
centroid in vec4 wrinkles;
#endif
#ifdef FOLDS
const float FLAT = 0.60;   // linear light of flat cloth in its picture, as in tools/figure/folds.py
centroid in float folded;
#endif
centroid in vec4 upright;
centroid in vec4 coordinates;
#ifdef SMOOTH
centroid in vec4 shade;
centroid in vec4 halfway;
#else
centroid in vec3 place;
centroid in vec4 colour;
centroid in vec4 light;
#endif
out vec4 pixel;

void main() {
    if (two_sided < 0.5 && !gl_FrontFacing && upright.w < -0.25) {
        pixel = vec4(encode(vec3(0.020, 0.0045, 0.004)), 1.0);
        return;
    }
    float opaque = coordinates.z;
    vec3 albedo = vec3(1.0);
#ifdef TEXTURED
    vec4 texel = textureLod(picture, coordinates.xy, 0.0);
#ifndef SOLID
    opaque *= texel.a;
    texel.rgb /= max(texel.a, 0.004); // colours of pictures with holes are multiplied by their alpha
#endif
    albedo = texel.rgb * texel.rgb;
#ifdef FOLDS
    albedo = max(albedo + folded * (albedo - FLAT), 0.15);
#endif
#endif
#if defined(CUT) || defined(VEIL)
    opaque *= opacity;
#endif
#ifdef CUT
    if (opaque < cut) discard;
    opaque = 1.0;
#endif
#ifdef WRINKLED
    vec2 spot = vec2(abs(wrinkle_place.x), wrinkle_place.y) * wrinkle_window.xy + wrinkle_window.zw;
    float depth = dot(textureLod(wrinkle_map, spot, 0.0) - 128.0 / 255.0, wrinkles) * 2.0;
    albedo *= max(1.0 + DARKENS * depth, 0.2);
#endif
#ifdef FINELY
    float lit = unshaded(before);
#else
    const float lit = 1.0;
#endif
#ifdef SMOOTH
    vec3 n = upright.xyz;
    vec3 base = shade.rgb * albedo;
#ifdef FINELY
    base -= (1.0 - lit) * keyed * albedo;
#endif
#ifdef FINE
    vec3 grain = (textureLod(relief, coordinates.xy * fine.y, 0.0).rgb - 0.5) * fine.x;
    base *= 1.0 + 0.40 * dot(grain, KEY_DIRECTION);
    n += grain;
#endif
    float cosine = dot(n, halfway.xyz);
    float nh2 = min(cosine * cosine / (dot(n, n) * dot(halfway.xyz, halfway.xyz)), 1.0);
    vec2 left = unlost(albedo);
    vec3 shown = base + KEY * (lit * shade.a * left.x * lobes(nh2, coordinates.w)) + AROUND * (halfway.w * left.y);
#else
    vec3 n = normalize(upright.xyz);
    vec3 view = normalize(eye - place);
    vec4 reach = vec4(lit * light.x, light.yzw);
    albedo *= colour.rgb;
    vec3 rough = n;
#ifdef FINE
    vec3 grain = (textureLod(relief, coordinates.xy * fine.y, 0.0).rgb - 0.5) * fine.x;
    rough = normalize(n + grain);
    n = normalize(n + grain * 0.45);
#endif
    float cosine = dot(rough, normalize(view + KEY_DIRECTION));
    vec2 left = unlost(albedo);
    vec3 shown = albedo * diffuse(n, albedo, reach, scatter * min(colour.a * 40.0, 1.0))
        + KEY * (mirrored_key(view, n, colour.a, reach) * left.x * lobes(cosine * cosine, coordinates.w))
        + AROUND * (mirrored_around(view, n, colour.a, reach) * left.y);
#endif
    pixel = vec4(encode(shown), opaque);
}

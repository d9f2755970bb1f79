#version 330 core
//include lighting.glsl
uniform sampler2D picture;
uniform float textured;    // 1: the picture times the colour
uniform sampler2D relief;  // noise of three channels
uniform vec2 fine;         // strength of the skin's relief, 0 for none, and how often it repeats
uniform float scatter;     // how far light goes below the surface: 1 skin, 0 cloth
uniform float two_sided;   // 0: what is seen from inside is a dark hollow
in vec3 place;
in vec3 normal;
in vec4 colour;
in vec2 texture_at;
in vec4 light;
in float cover;
out vec4 pixel;

void main() {
    vec3 view = normalize(eye - place);
    vec3 n = normalize(normal);
    if (!gl_FrontFacing) {
        if (two_sided > 0.5) {
            n = -n;
        } else if (dot(n, view) < -0.25) {  // less: a silhouette, where the inside shows by less than a pixel
            pixel = vec4(encode(vec3(0.020, 0.0045, 0.004)), 1.0);
            return;
        }
    }
    vec3 albedo = colour.rgb;
    float opaque = cover;
    if (textured > 0.5) {
        vec4 texel = texture(picture, texture_at);
        albedo *= decode(texel.rgb);
        opaque *= texel.a;
    }
    vec3 rough = n;
    if (fine.x > 0.0) {
        vec3 grain = texture(relief, texture_at * fine.y).rgb - 0.5;
        rough = normalize(n + grain * fine.x);
        n += grain * (fine.x * 0.45);
    }
    vec3 shown = surface(view, n, rough, albedo, colour.a, light, scatter);
    pixel = vec4(encode(shown), opaque);
}

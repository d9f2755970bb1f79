#version 330 core
// Antialiases a finished picture: where neighbours differ in brightness, it blends along the edge, further for
// shallower edges. Cheap enough for software OpenGL.
uniform sampler2D picture;
out vec4 pixel;

const vec3 BRIGHTNESS = vec3(0.299, 0.587, 0.114);
const float LEAST = 0.035;     // fainter edges are not smoothed
const float REACH = 6.0;       // pixels along the edge

float brightness(ivec2 at, ivec2 most) {
    return dot(texelFetch(picture, clamp(at, ivec2(0), most), 0).rgb, BRIGHTNESS);
}

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    ivec2 most = textureSize(picture, 0) - 1;
    vec4 here_ = texelFetch(picture, at, 0);
    vec3 centre = here_.rgb;
    if (here_.a < 0.5) {  // lines, dots and labels, which are drawn with smooth edges
        pixel = vec4(centre, 1.0);
        return;
    }
    float m = dot(centre, BRIGHTNESS);
    float nw = brightness(at + ivec2(-1, 1), most);
    float ne = brightness(at + ivec2(1, 1), most);
    float sw = brightness(at + ivec2(-1, -1), most);
    float se = brightness(at + ivec2(1, -1), most);
    float low = min(m, min(min(nw, ne), min(sw, se)));
    float high = max(m, max(max(nw, ne), max(sw, se)));
    pixel = vec4(centre, 1.0);
    // A loop with one step or none: software OpenGL can leave a loop early, but runs both branches of an `if`.
    float steps = high - low < max(LEAST, high * 0.06) ? 0.0 : 1.0;
    for (float i = 0.0; i < steps; i += 1.0) {
        vec2 along = vec2(sw + se - nw - ne, nw + sw - ne - se);
        float damping = max((nw + ne + sw + se) * 0.03, 1.0 / 128.0);
        along = clamp(along / (min(abs(along.x), abs(along.y)) + damping), -REACH, REACH);
        vec2 size = vec2(textureSize(picture, 0));
        vec2 here = gl_FragCoord.xy / size;
        vec2 by = along / size;
        vec3 near_ = 0.5 * (textureLod(picture, here - by / 6.0, 0.0).rgb + textureLod(picture, here + by / 6.0, 0.0).rgb);
        vec3 wide = 0.5 * near_ + 0.25 * (textureLod(picture, here - by * 0.5, 0.0).rgb + textureLod(picture, here + by * 0.5, 0.0).rgb);
        float far_ = dot(wide, BRIGHTNESS);
        pixel = vec4(far_ < low || far_ > high ? near_ : wide, 1.0);
    }
}

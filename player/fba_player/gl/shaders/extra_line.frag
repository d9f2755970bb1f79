#version 330 core
uniform float width;
uniform float crowded;    // lines shorter than this many pixels are fainter
in vec4 colour;
in float across;
in float span;
out vec4 pixel;

void main() {
    float cover = clamp(width * 0.5 + 0.5 - abs(across), 0.0, 1.0) * min(width, 1.0);
    cover *= colour.a * clamp(span / max(crowded, 1e-3), 0.16, 1.0);
    // Coverage belongs in linear light, but pictures blend as stored: corrected exactly for black, and on black.
    float bright = dot(colour.rgb, vec3(0.2126, 0.7152, 0.0722));
    float dark = 1.0 - pow(1.0 - cover, 0.4545);
    pixel = vec4(colour.rgb, mix(dark, pow(cover, 0.4545), bright * bright));
}

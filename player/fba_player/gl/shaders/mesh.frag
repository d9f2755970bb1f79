#version 330 core
//include lighting.glsl
uniform float two_sided;   // 0: the inside is drawn as a dark hollow
in vec3 place;
in vec3 normal;
in vec4 colour;
out vec4 pixel;

void main() {
    if (!gl_FrontFacing && two_sided < 0.5) {
        pixel = vec4(encode(vec3(0.020, 0.0045, 0.004)), 1.0);
        return;
    }
    pixel = vec4(encode(lit(place, normalize(normal), colour)), 1.0);
}

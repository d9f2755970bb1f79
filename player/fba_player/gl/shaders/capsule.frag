#version 330 core
//include lighting.glsl
uniform float opacity;
in vec3 place;
in vec3 normal;
in vec4 colour;
out vec4 pixel;

void main() {
    pixel = vec4(encode(lit(place, normalize(normal), colour)), opacity);
}

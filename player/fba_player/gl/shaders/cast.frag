#version 330 core
uniform sampler2D darkness;
uniform float contact;   // 1: the map holds half of what the ground's light is multiplied by
in vec2 at;
out vec4 pixel;

void main() {
    float seen = textureLod(darkness, at, 0.0).r;
    pixel = vec4(vec3(mix(1.0 - seen, seen, contact)), 1.0);  // what is left of the ground's light, or half
}

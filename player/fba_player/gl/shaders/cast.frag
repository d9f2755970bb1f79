#version 330 core
uniform sampler2D darkness;
in vec2 at;
out vec4 pixel;

void main() {
    pixel = vec4(vec3(1.0 - texture(darkness, at).r), 1.0);  // what it leaves of the ground's light
}

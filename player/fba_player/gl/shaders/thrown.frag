#version 330 core
in vec4 nearness;
in float top;
layout(location = 0) out vec4 pixel;
layout(location = 1) out vec2 first;

void main() {
    pixel = nearness;
    first = vec2(top, top * top);
}

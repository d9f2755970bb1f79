#version 330 core
in vec2 seen;
out vec4 pixel;        // the greatest is kept

void main() {
    pixel = vec4(seen, seen.y * seen.y, 0.0);
}

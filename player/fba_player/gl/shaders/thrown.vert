#version 330 core
//include lighting.glsl
// Triangles as one of two lights sees them: the key light, or the sky from above.
uniform float sky;     // 1: the sky
uniform vec2 low;      // x and z of the corner of the ground
uniform float width;   // metres of ground
uniform vec3 frame;    // corner of what the key light's map shows, along its axes, and its share of a metre
in vec3 in_position;   // in the world
out vec2 seen;         // 1, where there is something. Key light: height; sky: 1 on the ground, less above it

void main() {
    float high = max(in_position.y, 0.0);
    vec2 at = sky < 0.5 ? (in_position * BEFORE - frame.xy) * frame.z : (in_position.xz - low) / width;
    seen = vec2(1.0, sky < 0.5 ? high : max(1.0 - high / HIGHEST, 0.01));
    gl_Position = vec4(at * 2.0 - 1.0, 0.0, 1.0);
}

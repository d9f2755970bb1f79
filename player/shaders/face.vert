#version 330 core
// Parts of a face. The head turns as a whole; the neck bends along, and where it stands it stays.
uniform mat4 world;
uniform mat4 camera;
uniform vec3 turn;      // axis of the head's rotation times its angle
uniform vec3 centre;    // and the point it turns about
uniform vec3 eye;
uniform float pixel;    // size of a pixel at a distance of 1
in vec3 in_position;
in vec3 in_normal;
in vec4 in_colour;
in vec2 in_texture;
in vec4 in_light;       // what reaches the vertex: key light, open sky, through the skin, rim light
in float in_sway;       // how far it goes with the head
in vec4 in_across;      // of hairs: from the opposite vertex to this one, and half the width; else 0, 0, 0, 1
in vec4 in_along;       // of hairs: direction to the tip, and which of the two sides this is
out vec3 place;
out vec3 normal;
out vec4 colour;
out vec2 texture_at;
out vec4 light;
out float cover;        // how much of its pixels a hair covers

vec3 turned(vec3 at, vec3 axis, float sine, float cosine) {
    return at * cosine + cross(axis, at) * sine + axis * (dot(axis, at) * (1.0 - cosine));
}

void main() {
    vec3 at = in_position;
    vec3 out_ = in_normal;
    cover = 1.0;
    if (in_across.w < 0.9) {
        // No hair is thinner than a pixel, however it is turned; it is fainter instead.
        vec3 look = eye - (world * vec4(at, 1.0)).xyz;
        float least = 0.6 * pixel * length(look);
        vec3 side = cross(in_along.xyz, transpose(mat3(world)) * look);
        side /= max(length(side), 1e-9);
        float way = dot(side, in_across.xyz);
        at += side * (abs(way) > 0.05 ? sign(way) : in_along.w) * max(least - in_across.w * abs(way), 0.0);
        cover = clamp(in_across.w / least, 0.25, 1.0);
    }
    float angle = length(turn);
    if (angle > 1e-6) {
        vec3 axis = turn / angle;
        float sine = sin(angle * in_sway);
        float cosine = cos(angle * in_sway);
        at = centre + turned(at - centre, axis, sine, cosine);
        out_ = turned(out_, axis, sine, cosine);
    }
    vec4 stands = world * vec4(at, 1.0);
    place = stands.xyz;
    normal = mat3(world) * out_;
    colour = in_colour;
    texture_at = in_texture;
    light = in_light;
    gl_Position = camera * stands;
}

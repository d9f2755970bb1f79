#version 330 core
uniform vec2 centre;
uniform float reach;
uniform float step_;      // between bold lines, with ten fine steps between them
in vec2 at;
out vec4 pixel;

// Share of a pixel that lines at whole numbers cover; wide: their width, pixels. Lines denser than pixels give
// their mean.
float lines(vec2 place, float wide) {
    vec2 size = max(fwidth(place), vec2(1e-6));
    vec2 away = abs(fract(place - 0.5) - 0.5) / size;
    vec2 one = clamp(wide * 0.5 + 0.5 - away, 0.0, 1.0) * min(wide, 1.0);
    vec2 seen = 1.0 - smoothstep(0.25, 0.7, size);
    one = mix(min(wide * size, vec2(0.5)) * 0.6, one, seen);
    return max(one.x, one.y);
}

void main() {
    vec2 place = at / step_;
    float bold = lines(place, 1.6) * 0.85;
    float fine = lines(place * 10.0, 1.0) * 0.30;
    float far_ = length(at - centre) / reach;
    float fade = 1.0 - smoothstep(0.25, 1.0, far_);
    float fine_fade = 1.0 - smoothstep(0.1, 0.6, far_);
    vec2 axis = abs(at) / max(fwidth(at), vec2(1e-6));
    vec3 colour = vec3(0.93, 0.95, 0.98);
    if (axis.x < 1.3) colour = vec3(0.45, 0.62, 0.98);       // x = 0: along z, blue
    else if (axis.y < 1.3) colour = vec3(0.98, 0.45, 0.40);  // z = 0: along x, red
    pixel = vec4(colour, max(bold * fade, fine * fade * fine_fade));
}

// Vertices carried by joints, as fba/body/skinning_loops.py has it.
uniform sampler2D pose;    // two texels a joint: its dual quaternion, w x y z each; then two a bone: where it
uniform int bones;         // points and how far it twists, where it begins and how far the next joint does

struct Blend {
    vec4 turn;             // of any length
    vec4 shift;
};

vec4 joint_turn(int joint) {
    return texelFetch(pose, cell(2 * joint), 0);
}

vec4 joint_shift(int joint) {
    return texelFetch(pose, cell(2 * joint + 1), 0);
}

Blend blended(ivec4 joints, vec4 weights) {
    Blend found = Blend(weights.x * joint_turn(joints.x), weights.x * joint_shift(joints.x));
    for (int k = 1; k < 4; ++k) {
        if (weights[k] > 0.0) {
            found.turn += weights[k] * joint_turn(joints[k]);
            found.shift += weights[k] * joint_shift(joints[k]);
        }
    }
    return found;
}

vec3 turned(vec3 at, vec4 turn, float per) {
    return at + per * cross(turn.yzw, cross(turn.yzw, at) + turn.x * at);
}

vec3 shifted(vec4 turn, vec4 shift) {
    return turn.x * shift.yzw - turn.yzw * shift.x + cross(turn.yzw, shift.yzw);
}

float per(vec4 turn) {
    return 2.0 / max(dot(turn, turn), 1e-30);
}

// wring: the bone it is turned about, -1 for none, shares of both twists; how far matrices draw it straight.
vec3 carried(vec3 at, Blend blend, ivec4 joints, vec4 weights, vec4 wring) {
    if (wring.x >= 0.0) {
        vec4 axis = texelFetch(pose, cell(bones + 2 * int(wring.x)), 0);
        vec4 centre = texelFetch(pose, cell(bones + 2 * int(wring.x) + 1), 0);
        float angle = wring.y * axis.w + wring.z * centre.w;
        float cosine = cos(angle);
        vec3 p = at - centre.xyz;
        at = p * cosine + cross(axis.xyz, p) * sin(angle) + axis.xyz * (dot(axis.xyz, p) * (1.0 - cosine));
        at += centre.xyz;
    }
    float twice = per(blend.turn);
    vec3 found = turned(at, blend.turn, twice) + twice * shifted(blend.turn, blend.shift);
    if (wring.w > 0.0) {
        found *= 1.0 - wring.w;
        for (int k = 0; k < 4; ++k) {
            if (weights[k] > 0.0) {
                vec4 turn = joint_turn(joints[k]);
                vec3 straight = turned(at, turn, 2.0) + 2.0 * shifted(turn, joint_shift(joints[k]));
                found += wring.w * weights[k] * straight;
            }
        }
    }
    return found;
}

#version 330
// How open the surroundings of each point are: 1, or less where something is near and in front of it.
const int TAPS = 9;
const float REACH = 0.18;  // metres
const float STRENGTH = 1.9;
uniform sampler2D distances;
uniform vec2 slopes;  // half of what is seen across and up, at one metre
in vec2 place;
out vec2 seen;

vec3 at(vec2 p) {
    float z = textureLod(distances, p, 0.0).g;
    return vec3((p * 2.0 - 1.0) * slopes * z, z);
}

void main() {
    vec3 here = at(place);
    vec2 texel = 1.0 / vec2(textureSize(distances, 0));
    vec3 right = at(place + vec2(texel.x, 0.0)) - here, left = here - at(place - vec2(texel.x, 0.0));
    vec3 above = at(place + vec2(0.0, texel.y)) - here, below = here - at(place - vec2(0.0, texel.y));
    vec3 across = abs(right.z) < abs(left.z) ? right : left;
    vec3 up = abs(above.z) < abs(below.z) ? above : below;
    vec3 normal = normalize(cross(up, across));
    vec2 radius = min(REACH / (here.z * slopes) * 0.5, vec2(0.12));
    ivec2 pixel = ivec2(gl_FragCoord.xy) & 3;
    float turn = float((pixel.x * 4 + pixel.y * 7) & 15) / 16.0 * 6.2831853;
    float hidden = 0.0;
    for (int i = 0; i < TAPS; i++) {
        float angle = float(i) * 2.399963 + turn;
        vec3 way = at(place + vec2(cos(angle), sin(angle)) * pow((float(i) + 0.5) / float(TAPS), 1.6) * radius) - here;
        float square = dot(way, way) + 1e-6;
        float inverse = inversesqrt(square);
        hidden += max(dot(way, normal) * inverse - 0.12, 0.0) * max(1.0 - square * inverse / REACH, 0.0);
    }
    seen = vec2(clamp(1.0 - hidden * STRENGTH / float(TAPS), 0.0, 1.0), here.z);
}

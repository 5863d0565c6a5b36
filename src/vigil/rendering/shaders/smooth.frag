#version 330
// Averages over the four by four pixels among which the taps rotate, if they are equally far away.
uniform sampler2D nearness;
in vec2 place;
out vec2 seen;

void main() {
    vec2 texel = 1.0 / vec2(textureSize(nearness, 0));
    float here = textureLod(nearness, place, 0.0).g, total = 0.0, weight = 0.0;
    for (int x = -2; x < 2; x++)
        for (int y = -2; y < 2; y++) {
            vec2 there = textureLod(nearness, place + vec2(x, y) * texel, 0.0).rg;
            float share = max(0.001, 1.0 - abs(there.g - here) / (0.05 * here));
            total += share * there.r;
            weight += share;
        }
    seen = vec2(total / weight, here);
}

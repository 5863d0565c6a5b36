#version 330
// Averages over the four by two pixels among which the taps rotate, if they are equally far away.
uniform sampler2D nearness;
out float seen;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy), last = textureSize(nearness, 0) - 1;
    float here = texelFetch(nearness, pixel, 0).g, total = 0.0, weight = 0.0;
    for (int x = -2; x < 2; x++)
        for (int y = -1; y < 1; y++) {
            vec2 there = texelFetch(nearness, clamp(pixel + ivec2(x, y), ivec2(0), last), 0).rg;
            float share = max(0.001, 1.0 - abs(there.g - here) * (20.0 / here));
            total += share * there.r;
            weight += share;
        }
    seen = total / weight;
}

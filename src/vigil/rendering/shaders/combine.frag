#version 330
// The picture, darker where its surroundings are less open.
const float DARKEST = 0.42;
uniform sampler2D picture;
uniform sampler2D nearness;
uniform sampler2D depth;
uniform vec2 planes;
in vec2 place;
out vec4 seen;

void main() {
    float far = planes.x * planes.y / (planes.y - textureLod(depth, place, 0.0).r * (planes.y - planes.x));
    vec2 size = vec2(textureSize(nearness, 0));
    vec2 corner = floor(place * size - 0.5) + 0.5, part = place * size - corner;
    float total = 0.0, weight = 0.0;
    for (int x = 0; x < 2; x++)
        for (int y = 0; y < 2; y++) {
            vec2 there = textureLod(nearness, (corner + vec2(x, y)) / size, 0.0).rg;
            float share = (x == 1 ? part.x : 1.0 - part.x) * (y == 1 ? part.y : 1.0 - part.y)
                        * max(0.001, 1.0 - abs(there.g - far) / (0.05 * far)) + 1e-6;
            total += share * there.r;
            weight += share;
        }
    seen = vec4(textureLod(picture, place, 0.0).rgb * sqrt(mix(DARKEST, 1.0, total / weight)), 1.0);
}

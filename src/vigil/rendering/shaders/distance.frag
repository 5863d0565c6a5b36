#version 330
// The distance of each pixel at half the size: the nearest of four pixels.
uniform sampler2D depth;
uniform vec2 planes;  // near, far
in vec2 place;
out vec2 seen;

void main() {
    vec2 texel = 0.5 / vec2(textureSize(depth, 0));
    float d = min(min(textureLod(depth, place + texel, 0.0).r, textureLod(depth, place - texel, 0.0).r),
                  min(textureLod(depth, place + vec2(texel.x, -texel.y), 0.0).r, textureLod(depth, place + vec2(-texel.x, texel.y), 0.0).r));
    seen = vec2(1.0, planes.x * planes.y / (planes.y - d * (planes.y - planes.x)));
}

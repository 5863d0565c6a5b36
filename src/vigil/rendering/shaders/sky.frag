#version 330
uniform samplerCube sky;
uniform mat3 rays;
in vec2 place;
out vec4 seen;

void main() {
    vec3 way = rays * vec3(place * 2.0 - 1.0, 1.0);
    seen = vec4(texture(sky, vec3(way.x, way.z, -way.y)).rgb, 1.0);
}

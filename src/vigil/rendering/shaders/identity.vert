#version 330
uniform mat4 view_projection;
uniform sampler2D geoms;
in vec3 position;
in int geom;
flat out int owner;

void main() {
    vec4 local = vec4(position, 1.0);
    vec3 world = vec3(dot(texelFetch(geoms, ivec2(0, geom), 0), local), dot(texelFetch(geoms, ivec2(1, geom), 0), local),
                      dot(texelFetch(geoms, ivec2(2, geom), 0), local));
    owner = geom;
    gl_Position = view_projection * vec4(world, 1.0);
}

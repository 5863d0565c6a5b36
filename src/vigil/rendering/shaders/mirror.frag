#version 330
// The picture of the mirror, which has been drawn before, where the mirror is.
uniform sampler2D mirrored;
uniform vec2 size;
out vec4 seen;

void main() { seen = vec4(texture(mirrored, gl_FragCoord.xy / size).rgb * vec3(0.90, 0.93, 0.94) + 0.02, 1.0); }

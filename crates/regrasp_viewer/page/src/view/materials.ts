// Materials. The object carries a pattern in its own frame, so that its turning is seen: eight fields about the middle of its
// box, a dot where x leaves it and a ring about z. It is worked out per pixel, for any mesh.

import { Color, MeshLambertMaterial, Vector3, type MeshLambertMaterialParameters } from "three";

export interface PatternColours { light: Color; dark: Color; mark: Color }

const VERTEX = `
varying vec3 vInObject;
`;

const FRAGMENT = `
varying vec3 vInObject;
uniform vec3 patternMiddle;
uniform vec3 patternHalf;
uniform vec3 patternLight;
uniform vec3 patternDark;
uniform vec3 patternMark;
`;

const COLOUR = `
vec3 inBox = (vInObject - patternMiddle) / patternHalf;
vec3 side = clamp(inBox / (fwidth(inBox) + 1e-5), -1.0, 1.0);
vec3 painted = mix(patternDark, patternLight, 0.5 + 0.5 * side.x * side.y * side.z);
vec3 outward = normalize(inBox);
vec2 blur = fwidth(outward.xz) + 1e-4;
float dotOfX = smoothstep(-blur.x, blur.x, outward.x - 0.980);
float ringOfZ = smoothstep(-blur.y, blur.y, outward.z - 0.887) * (1.0 - smoothstep(-blur.y, blur.y, outward.z - 0.936));
diffuseColor.rgb = mix(painted, patternMark, max(dotOfX, ringOfZ));
`;

export function patterned(middle: Vector3, half: Vector3, colours: PatternColours, parameters: MeshLambertMaterialParameters = {}): MeshLambertMaterial {
  const material = new MeshLambertMaterial(parameters);
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, {
      patternMiddle: { value: middle },
      patternHalf: { value: half },
      patternLight: { value: colours.light },
      patternDark: { value: colours.dark },
      patternMark: { value: colours.mark },
    });
    shader.vertexShader = VERTEX + shader.vertexShader.replace("#include <begin_vertex>", "#include <begin_vertex>\nvInObject = position;");
    shader.fragmentShader = FRAGMENT + shader.fragmentShader.replace("#include <color_fragment>", `#include <color_fragment>\n${COLOUR}`);
  };
  return material;
}

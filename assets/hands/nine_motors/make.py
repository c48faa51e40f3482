"""Writes hand.urdf: a hand of nine motors and twenty joints, coupled within and across fingers.

One motor spreads index, ring and little finger. One opposes the thumb and folds the palm under ring and little finger. Thumb,
ring and little finger close by one motor each, index and middle finger by two. Run it in this folder: python make.py
"""

RADIUS = 0.008
LENGTHS = {"thumb": (0.048, 0.032, 0.024), "finger": (0.048, 0.030, 0.022)}


def link(name: str, along: str = "", length: float = 0.0) -> str:
    """A link; with a length, a capsule along the axis `along` of its frame."""
    if not along:
        return f'  <link name="{name}"/>\n'
    turn, at = ("0 1.5707963267948966 0", f"{length / 2} 0 0") if along == "x" else ("0 0 0", f"0 0 {length / 2}")
    shape = f'<capsule radius="{RADIUS}" length="{length}"/>'
    return f'  <link name="{name}"><collision><origin xyz="{at}" rpy="{turn}"/><geometry>{shape}</geometry></collision></link>\n'


def joint(name, parent, child, xyz, axis, upper, mimic=None, rpy="0 0 0", lower=0.0) -> str:
    """A turning joint; `mimic` is the joint that it follows and the multiplier."""
    follow = f'<mimic joint="{mimic[0]}" multiplier="{mimic[1]}"/>' if mimic else ""
    return (
        f'  <joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/>'
        f'<limit lower="{lower}" upper="{upper}" velocity="2" effort="2"/>{follow}</joint>\n'
    )


def chain(name, root, parent, xyz, joints, along="z", axis="0 1 0", lengths=LENGTHS["finger"]) -> str:
    """Three phalanges from link `parent` on; `joints` are (name, upper limit, mimic)."""
    text, at = "", xyz
    for k, ((own, upper, mimic), length) in enumerate(zip(joints, lengths)):
        child = f"{name}_{k + 1}"
        text += link(child, along, length) + joint(own, parent, child, at, axis, upper, mimic)
        parent, at = child, f"{length} 0 0" if along == "x" else f"0 0 {length}"
    return root + text


def hand() -> str:
    """The whole URDF."""
    text = '<robot name="nine_motors">\n'
    text += (
        '  <link name="palm"><collision><origin xyz="-0.008 0.008 0.05"/><geometry><box size="0.016 0.05 0.09"/></geometry>'
        "</collision></link>\n"
    )
    text += link("thumb_0") + joint(
        "thumb_opposition", "palm", "thumb_0", "0.01 0.02 0.03", "0 0 -1", 0.98, rpy="0 0 1.2"
    )
    flexion = ("thumb_flexion", 0.97, None)
    followers = [("thumb_3", 1.0, ("thumb_flexion", 1.015)), ("thumb_4", 1.41, ("thumb_flexion", 1.449))]
    text += chain("thumb", "", "thumb_0", "0.01 0 0", [flexion, *followers], "x", "0 -1 0", LENGTHS["thumb"])
    text += link("index_0") + joint(
        "index_spread", "palm", "index_0", "0 0.03 0.1", "-1 0 0", 0.3, ("finger_spread", 0.5)
    )
    text += chain(
        "index",
        "",
        "index_0",
        "0 0 0.008",
        [("index_proximal", 0.8, None), ("index_distal", 1.33, None), ("index_end", 1.39, ("index_distal", 1.045))],
    )
    text += chain(
        "middle",
        "",
        "palm",
        "0 0.008 0.112",
        [("middle_proximal", 0.8, None), ("middle_distal", 1.33, None), ("middle_end", 1.39, ("middle_distal", 1.045))],
    )
    text += (
        '  <link name="fold"><collision><origin xyz="-0.008 -0.02 0.05"/><geometry><box size="0.014 0.03 0.08"/></geometry>'
        "</collision></link>\n"
    )
    text += joint("palm_fold", "palm", "fold", "0 -0.02 0", "0 0 1", 0.98, ("thumb_opposition", 1.0))
    text += link("ring_0") + joint("ring_spread", "fold", "ring_0", "0 -0.005 0.1", "1 0 0", 0.3, ("finger_spread", 0.5))
    ends = lambda name: [  # noqa: E731
        (name, 0.98, None),
        (f"{name}_2", 1.34, (name, 1.3588)),
        (f"{name}_3", 1.4, (name, 1.42093)),
    ]
    text += chain("ring", "", "ring_0", "0 0 0.005", ends("ring"))
    text += link("little_0") + joint("finger_spread", "fold", "little_0", "0 -0.028 0.085", "1 0 0", 0.58)
    text += chain("little", "", "little_0", "0 0 0.005", ends("little"))
    return text + "</robot>\n"


if __name__ == "__main__":
    with open("hand.urdf", "w", encoding="utf-8") as file:
        file.write(hand())

"""Programs as PolyScope saves them, written by hand."""


def saved(*nodes, before="", threads="", repeats=False, **attributes):
    given = "".join(f' {name}="{value}"' for name, value in attributes.items())
    once = str(not repeats).lower()
    main = f"<MainProgram runOnlyOnce='{once}'{given}><children>{''.join(nodes)}</children>"
    return f"<URProgram installation='cell'><children>{before}{main}</MainProgram>{threads}</children></URProgram>"


def expression(*parts):
    """An expression of characters, and of elements, which begin with <."""
    written = (part if part.startswith("<") else _characters(part) for part in parts)
    return f"<expression>{''.join(written)}</expression>"


def _characters(text):
    return "".join(f'<ExpressionChar character="{letter}"/>' for letter in text)


def waypoint(name, q, parameters="<motionParameters/>", kinematics=""):
    angles = ", ".join(map(str, q))
    position = f"<position><JointAngles angles='{angles}'/>{kinematics}</position>"
    return f"<Waypoint type='Fixed' name='{name}'>{parameters}{position}</Waypoint>"


def move(*nodes, kind="MoveJ", inside="", **attributes):
    given = {"speed": 1.5, "acceleration": 2.0, "useActiveTCP": "true"} | attributes
    words = " ".join(f"{name}='{value}'" for name, value in given.items())
    return f"<Move motionType='{kind}' {words}>{inside}<children>{''.join(nodes)}</children></Move>"


def contributed(cap, kind, *nodes, name="Robotiq_Grippers", **data):
    model = "".join(f"<data key='{key}' value='{value}'/>" for key, value in data.items())
    inside = f"<children>{''.join(nodes)}</children>" if nodes else ""
    words = f"strategyClass='{cap}' strategyProgramNodeType='{kind}' strategyURCapName='{name}'"
    return f"<Contributed {words}><dataModel>{model}</dataModel>{inside}</Contributed>"

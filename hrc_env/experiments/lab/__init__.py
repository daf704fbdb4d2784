"""The paper's laboratory (section 4.2): all joints, five kinds of motion, one camera or four."""

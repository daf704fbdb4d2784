"""The paper's laboratory (section 4.2): all joints, six kinds of motion, one camera or four."""

"""The paper's simulation (section 4.1): a walk over the site, from single cameras and from four."""

"""The paper's simulation (section 4.1): a walk over the site, single cameras against four."""

"""Speed and accuracy of perception from pixels, and the effects of camera faults."""

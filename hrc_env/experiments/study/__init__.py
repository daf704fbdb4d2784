"""What all experiments share: parts that are kept, folders that are claimed, intervals, a page."""

"""How good labels and surveys are.

``evaluation`` compares labels with a truth. The self-check needs none: ``self_check`` leaves landmarks out in turn,
``landmark_gain`` says where one more landmark would help, ``self_check_record`` is what is kept. ``diagnosis`` names
what is wrong with a survey.
"""

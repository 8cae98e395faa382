# Clips as Godot 3 plays them: the GLB files of this project, which the editor imported; beside each NAME.json says where its joints are.
extends SceneTree

func _init():
	var good = true
	var folder = Directory.new()
	folder.open("res://")
	folder.list_dir_begin(true, true)
	var name = folder.get_next()
	while name != "":
		if name.ends_with(".glb"):
			good = played(name) and good
		name = folder.get_next()
	OS.exit_code = 0 if good else 1
	quit()

func played(name):
	var file = File.new()
	file.open("res://" + name.replace(".glb", ".json"), File.READ)
	var expected = JSON.parse(file.get_as_text()).result
	file.close()
	var scene = load("res://" + name).instance()
	get_root().add_child(scene)
	var good = expected.size() > 0
	for clip in expected:
		var off = farthest(scene, clip)
		print("%s: %s: %d joints, %d times, off by %.7f of their size" % [name,
			"at rest" if clip.clip == null else clip.clip, clip.joints.size(), clip.times.size(), off])
		good = good and off < 1e-4
	get_root().remove_child(scene)
	scene.free()
	return good

# How far the joints are off at most, as a part of the skeleton's size.
func farthest(scene, clip):
	var player = scene.find_node("AnimationPlayer", true, false)
	var joints = []
	for joint in clip.joints:
		joints.append(find(scene, joint.name))
		if joints.back() == null:
			print("no joint ", joint.name)
			return INF
	var box = AABB(place(clip.places[0][0]), Vector3())
	var most = 0.0
	for t in range(clip.times.size()):
		if clip.clip != null:
			player.play(clip.clip)
			player.seek(clip.times[t], true)
		for j in range(joints.size()):
			var own = place(clip.places[t][j])
			box = box.expand(own)
			most = max(most, position(joints[j]).distance_to(own))
	return most / box.get_longest_axis_size()

func place(numbers):
	return Vector3(numbers[0], numbers[1], numbers[2])

# A joint's skeleton and bone, or its node. Godot spells names otherwise: "left_hand" for "leftHand".
func find(node, joint):
	if node is Skeleton:
		for bone in range(node.get_bone_count()):
			if letters(node.get_bone_name(bone)) == letters(joint):
				return [node, bone]
	for child in node.get_children():
		var found = find(child, joint)
		if found != null:
			return found
	return [node, -1] if node is Spatial and letters(node.name) == letters(joint) else null

func position(joint):
	var world = joint[0].global_transform
	return (world if joint[1] < 0 else world * joint[0].get_bone_global_pose(joint[1])).origin

func letters(name):
	for blank in ["_", ":", "/", ".", " ", "0"]:
		name = name.replace(blank, "")
	return name.to_lower()

#[test]
fn show() {
    use nicolson::scene::Scene;
    let text = std::fs::read_to_string("/tmp/bad.toml").unwrap();
    let over: Vec<(String, String)> = std::env::var("SETS")
        .unwrap_or_default()
        .split_whitespace()
        .map(|s| {
            let (a, b) = s.split_once('=').unwrap();
            (a.into(), b.into())
        })
        .collect();
    match Scene::parse(&text, "scene.toml", std::path::Path::new("/tmp"), &over).and_then(|s| {
        eprintln!("{}", s.text());
        s.setup::<2>()
    }) {
        Ok((_, w)) => println!("OK {w:?}"),
        Err(e) => println!("{e}"),
    }
}
